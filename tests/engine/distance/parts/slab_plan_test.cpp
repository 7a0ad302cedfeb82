#include "engine/distance/parts/slab_plan.h"

#include <gtest/gtest.h>

#include <array>
#include <set>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kMiB = 1048576;
constexpr std::uint64_t kMerlVoxels = 1'096'216;

/// The limits of lavapipe, as it reports them.
device::Limits lavapipe_limits() {
    return {.storage_buffer_bytes = 128 * kMiB,
            .texel_buffer_texels = 134'217'728,
            .allocation_bytes = 2048 * kMiB,
            .heap_bytes = 2048 * kMiB,
            .groups_x = 65535,
            .groups_y = 65535,
            .subgroup_size = 8};
}

const std::array<const Metric*, 2>& two_metrics() {
    static const std::array<const Metric*, 2> metrics = {&find_metric("cwcbrt"),
                                                         &find_metric("pawcielab")};
    return metrics;
}

/// A metric whose grid the device makes.
const Metric& of_a_user() {
    static const Metric metric = [] {
        Metric copy = find_metric("pawcielab");
        copy.twin = {};
        return copy;
    }();
    return metric;
}

void expect_within(const SlabPlan& plan, const device::Limits& limits, std::uint64_t memory) {
    EXPECT_LE(plan.device_bytes + plan.host_bytes + plan.other_bytes, memory);
    for (const auto* metric : two_metrics()) {
        EXPECT_LE(plan.sums_bytes(*metric), limits.storage_buffer_bytes);
        EXPECT_LE(plan.grid_bytes(*metric), limits.storage_buffer_bytes);
        EXPECT_LE(plan.grid_bytes(*metric) / 16, limits.texel_buffer_texels);
        EXPECT_LE(plan.tiles(*metric).count(), limits.groups_x);
        EXPECT_GE(plan.tiles(*metric).padded_materials(), plan.materials);
    }
    EXPECT_LE(plan.slab_blocks, limits.groups_y);
}

TEST(SlabPlan, CoversAllVoxelsWithinEveryLimit) {
    const std::array<const Metric*, 2> with_a_user = {&find_metric("cwcbrt"), &of_a_user()};
    for (const auto& metrics : {two_metrics(), with_a_user}) {
        for (const std::uint64_t materials : {2, 10, 11, 100, 400, 1000}) {
            for (const std::uint64_t memory : {128 * kMiB, 256 * kMiB, 1024 * kMiB}) {
                const auto limits = lavapipe_limits();
                const auto plan = plan_slabs(limits, memory, materials, kMerlVoxels, metrics);
                expect_within(plan, limits, memory);
                EXPECT_GE(plan.slabs * plan.slab_voxels(), kMerlVoxels);
                EXPECT_LT((plan.slabs - 1) * plan.slab_voxels(), kMerlVoxels);
                EXPECT_EQ(plan.materials, materials);
                if (metrics[1] == &of_a_user()) {
                    EXPECT_LE(plan.samples_bytes(), limits.storage_buffer_bytes);
                    EXPECT_LE(plan.geometry_bytes(), limits.storage_buffer_bytes);
                }
            }
        }
    }
}

TEST(SlabPlan, SmallLimitsMakeSmallSlabs) {
    auto limits = lavapipe_limits();
    limits.storage_buffer_bytes = 4 * kMiB;
    auto plan = plan_slabs(limits, 1024 * kMiB, 100, kMerlVoxels, two_metrics());
    expect_within(plan, limits, 1024 * kMiB);
    limits = lavapipe_limits();
    limits.texel_buffer_texels = 3 * 1024 * 100 * 3 / 2;  // three blocks of samples, two a texel
    const std::array<const Metric*, 1> user = {&of_a_user()};
    plan = plan_slabs(limits, 1024 * kMiB, 100, kMerlVoxels, user);
    EXPECT_EQ(plan.slab_blocks, 3U);
    limits = lavapipe_limits();
    limits.groups_y = 200;
    EXPECT_LE(plan_slabs(limits, 1024 * kMiB, 2, kMerlVoxels, two_metrics()).slab_blocks, 200U);
}

TEST(SlabPlan, ReadingAndComputingOverlap) {
    auto limits = lavapipe_limits();
    limits.storage_buffer_bytes = 4096 * kMiB;
    EXPECT_GE(plan_slabs(limits, 65536 * kMiB, 100, kMerlVoxels, two_metrics()).slabs, 4U);
    EXPECT_EQ(plan_slabs(limits, 65536 * kMiB, 100, 100, two_metrics()).slabs, 1U);
}

TEST(SlabPlan, SlabsStayNearCachesThatDeviceAndHostShare) {
    auto limits = lavapipe_limits();
    limits.is_host = true;
    for (const std::uint64_t materials : {2, 100, 1000}) {
        const auto plan = plan_slabs(limits, 1024 * kMiB, materials, kMerlVoxels, two_metrics());
        EXPECT_EQ(plan.device_bytes, 0U);
        EXPECT_TRUE(plan.host_bytes <= 33 * kMiB || plan.slab_blocks == 1);
        EXPECT_GE(plan.slabs * plan.slab_voxels(), kMerlVoxels);
    }
}

TEST(SlabPlan, TheHostTakesWhatHasATwinAndADegreeWhereItIsTheDevice) {
    auto limits = lavapipe_limits();
    const std::array<const Metric*, 3> metrics = {&find_metric("cwcbrt"), &of_a_user(),
                                                  &find_metric("paw-ciede2000")};
    const auto on_host = [&](bool shaders_only) {
        const auto plan = plan_slabs(limits, 1024 * kMiB, 100, kMerlVoxels, metrics, shaders_only);
        EXPECT_GT(plan.device_bytes, 0U);
        return std::array{plan.on_host(*metrics[0]), plan.on_host(*metrics[1]),
                          plan.on_host(*metrics[2])};
    };
    EXPECT_EQ(on_host(false), (std::array{false, false, false}));
    limits.is_host = true;
    EXPECT_EQ(on_host(false), (std::array{true, false, false}));
    EXPECT_EQ(on_host(true), (std::array{false, false, false}));
}

TEST(SlabPlan, TotalsOfManyMaterialsCountToo) {
    // 10,000 materials: 5e7 pairs, of which CWCbrt has two float64 totals and PAWCIELAB one.
    auto limits = lavapipe_limits();
    limits.is_host = true;
    try {
        plan_slabs(limits, 1024 * kMiB, 10'000, kMerlVoxels, two_metrics());
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::usage) << error.what();
    }
    const auto plan = plan_slabs(limits, 4096 * kMiB, 10'000, kMerlVoxels, two_metrics());
    EXPECT_GT(plan.host_bytes, std::uint64_t{3} * 8 * 50'000'000);
    EXPECT_LE(plan.host_bytes, 4096 * kMiB);
}

TEST(SlabPlan, WhatThreadsReadCountsToo) {
    auto limits = lavapipe_limits();
    for (const bool is_host : {false, true}) {
        limits.is_host = is_host;
        for (const std::uint64_t threads : {1, 2, 64}) {
            const auto plan =
                plan_slabs(limits, 64 * kMiB, 100, kMerlVoxels, two_metrics(), false, threads);
            expect_within(plan, limits, 64 * kMiB);
            EXPECT_GE(plan.other_bytes, threads * plan.slab_blocks * sizeof(BlockSamples) +
                                            plan.slab_voxels() * sizeof(Voxel));
        }
        // Of four materials no more than four are read at a time.
        const auto few = plan_slabs(limits, 64 * kMiB, 4, kMerlVoxels, two_metrics(), false, 64);
        EXPECT_LT(few.other_bytes, 16 * few.slab_blocks * sizeof(BlockSamples));
    }
}

TEST(SlabPlan, TotalsOfTheDeviceCountToo) {
    const std::array<const Metric*, 1> metric = {&find_metric("rmse")};
    const auto plan = plan_slabs(lavapipe_limits(), 1024 * kMiB, 1000, kMerlVoxels, metric);
    EXPECT_GE(plan.other_bytes, std::uint64_t{1000} * 999 / 2 * sizeof(double));
}

TEST(SlabPlan, OnTheHostNoLimitOfTheDeviceCounts) {
    auto limits = lavapipe_limits();
    limits.is_host = true;
    limits.storage_buffer_bytes = kMiB;
    limits.groups_x = 2;
    limits.groups_y = 2;
    EXPECT_NO_THROW(plan_slabs(limits, 1024 * kMiB, 100, kMerlVoxels, two_metrics()));
    EXPECT_THROW(plan_slabs(limits, 1024 * kMiB, 100, kMerlVoxels, two_metrics(), true), Error);
}

TEST(PairTiles, EveryPairHasOnePlace) {
    for (const std::uint32_t across : {1U, 2U, 7U}) {
        const PairTiles tiles = {.side = 3, .across = across};
        std::set<std::size_t> places;
        for (std::uint32_t i = 0; i < tiles.padded_materials(); ++i) {
            for (std::uint32_t j = i + 1; j < tiles.padded_materials(); ++j) {
                const auto at = tiles.sum_index(i, j);
                places.insert(at);
                const auto [row, column] =
                    tiles.place_of(static_cast<std::uint32_t>(at / tiles.pairs_of_tile()));
                EXPECT_EQ(row, i / 3 * 3);
                EXPECT_EQ(column, j / 3 * 3);
            }
        }
        const auto n = std::size_t{tiles.padded_materials()};
        EXPECT_EQ(places.size(), n * (n - 1) / 2);
        EXPECT_LT(*places.rbegin(), tiles.count() * tiles.pairs_of_tile());
    }
}

TEST(SlabPlan, TooLittleMemoryIsAUsageErrorThatSaysHowMuchIsNeeded) {
    try {
        plan_slabs(lavapipe_limits(), kMiB, 100, kMerlVoxels, two_metrics());
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::usage);
        EXPECT_NE(std::string(error.what()).find("--memory 1048576 bytes is too small"),
                  std::string::npos)
            << error.what();
    }
}

TEST(SlabPlan, TooManyMaterialsAreADeviceError) {
    for (const std::uint64_t materials : {4000ULL, 100'000ULL, 1ULL << 40U}) {
        try {
            plan_slabs(lavapipe_limits(), 1024 * kMiB, materials, kMerlVoxels, two_metrics());
            FAIL() << materials;
        } catch (const Error& error) {
            EXPECT_EQ(error.fault(), Fault::device);
        }
    }
}

}  // namespace
}  // namespace merl::engine
