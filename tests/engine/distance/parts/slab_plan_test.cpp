#include "engine/distance/parts/slab_plan.h"

#include <gtest/gtest.h>

#include <array>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kMiB = 1048576;
constexpr std::uint64_t kMerlVoxels = 1'096'216;

SlabPlan plan(const EngineNeeds& needs, std::uint64_t memory, const Workload& workload) {
    return plan_slabs(std::array{needs}, memory, workload);
}

TEST(SlabPlan, CoversAllVoxelsWithinMemoryAndWhatEnginesCan) {
    for (const std::uint64_t materials : {2U, 10U, 100U, 1000U}) {
        for (const std::uint64_t memory : {128 * kMiB, 256 * kMiB, 1024 * kMiB}) {
            for (const std::uint64_t most : {std::uint64_t{3}, EngineNeeds::kUnbounded}) {
                const std::array needs = {EngineNeeds{.fixed_bytes = materials * materials * 4,
                                                      .block_bytes = materials * 30'000,
                                                      .most_blocks = most},
                                          EngineNeeds{.fixed_bytes = kMiB, .block_bytes = 10'000}};
                const auto p =
                    plan_slabs(needs, memory, {.materials = materials, .voxels = kMerlVoxels});
                EXPECT_LE(p.bytes, memory);
                EXPECT_LE(p.slab_blocks, most);
                EXPECT_GE(p.slabs * p.slab_voxels(), kMerlVoxels);
                EXPECT_LT((p.slabs - 1) * p.slab_voxels(), kMerlVoxels);
            }
        }
    }
}

TEST(SlabPlan, ReadingAndComputingOverlap) {
    const EngineNeeds needs = {.block_bytes = 1000};
    EXPECT_EQ(plan(needs, 65536 * kMiB, {.materials = 100, .voxels = kMerlVoxels}).slabs, 4U);
    EXPECT_EQ(plan(needs, 65536 * kMiB, {.materials = 100, .voxels = 100}).slabs, 1U);
}

TEST(SlabPlan, SlabsStayNearTheCachesThatEnginesWorkFrom) {
    const EngineNeeds large = {.block_bytes = kMiB};
    const EngineNeeds cached = {.block_bytes = kMiB, .cached = true};
    const Workload workload = {.materials = 100, .voxels = kMerlVoxels};
    EXPECT_GT(plan(large, 1024 * kMiB, workload).slab_blocks, 32U);
    EXPECT_EQ(plan(cached, 1024 * kMiB, workload).slab_blocks, 32U);
    EXPECT_EQ(plan_slabs(std::array{large, cached}, 1024 * kMiB, workload).slab_blocks, 16U);
    const EngineNeeds huge = {.block_bytes = 100 * kMiB, .cached = true};
    EXPECT_EQ(plan(huge, 1024 * kMiB, workload).slab_blocks, 1U);
}

TEST(SlabPlan, WhatIsReadCountsToo) {
    const EngineNeeds needs = {.block_bytes = 1000};
    for (const std::uint64_t threads : {1U, 2U, 64U}) {
        const Workload workload = {
            .materials = 100, .voxels = kMerlVoxels, .threads = threads, .list_bytes = kMiB};
        const auto p = plan(needs, 64 * kMiB, workload);
        EXPECT_LE(p.bytes, 64 * kMiB);
        EXPECT_GE(p.bytes, kMiB + threads * p.slab_blocks * sizeof(BlockSamples) +
                               p.slab_voxels() * sizeof(Voxel));
    }
    // Of four materials no more than four are read at a time.
    const auto few = plan(needs, 64 * kMiB, {.materials = 4, .voxels = kMerlVoxels, .threads = 64});
    EXPECT_LT(few.bytes, kMiB + 16 * few.slab_blocks * sizeof(BlockSamples));
}

TEST(SlabPlan, TooLittleMemorySaysHowMuchIsNeeded) {
    const EngineNeeds needs = {.fixed_bytes = 10 * kMiB, .block_bytes = 1000};
    const Workload workload = {.materials = 100, .voxels = kMerlVoxels};
    std::uint64_t least = 0;
    try {
        plan(needs, kMiB, workload);
        FAIL();
    } catch (const MemoryError& error) {
        EXPECT_EQ(error.fault(), Fault::usage);
        const std::string text = error.what();
        EXPECT_NE(text.find("1048576 bytes of memory is too small"), std::string::npos) << text;
        least = std::stoull(text.substr(text.rfind('(') + 1));
    }
    EXPECT_EQ(plan(needs, least, workload).slab_blocks, 1U);
    EXPECT_THROW(plan(needs, least - 1, workload), MemoryError);
}

}  // namespace
}  // namespace merl::engine
