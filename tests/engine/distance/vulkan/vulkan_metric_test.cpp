#include "engine/distance/vulkan/vulkan_metric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kMiB = 1048576;

/// The limits of lavapipe, as it reports them.
device::Limits lavapipe_limits() {
    return {.storage_buffer_bytes = 128 * kMiB,
            .texel_buffer_texels = 134'217'728,
            .allocation_bytes = 2048 * kMiB,
            .heap_bytes = 2048 * kMiB,
            .free_bytes = 1638 * kMiB,
            .groups_x = 65535,
            .groups_y = 65535,
            .subgroup_size = 8};
}

const std::array<const Metric*, 2>& two_metrics() {
    static const std::array<const Metric*, 2> metrics = {&find_metric("cwcbrt"),
                                                         &find_metric("pawcielab")};
    return metrics;
}

TEST(DeviceNeeds, EveryBufferAndDispatchIsWithinTheLimits) {
    for (const std::uint32_t materials : {2U, 10U, 11U, 100U, 400U, 1000U}) {
        auto limits = lavapipe_limits();
        for (const std::uint64_t bytes : {128 * kMiB, 32 * kMiB}) {
            limits.storage_buffer_bytes = bytes;
            limits.free_bytes = bytes == 32 * kMiB ? 256 * kMiB : 1638 * kMiB;
            const auto needs = device_needs(limits, two_metrics(), materials);
            const DeviceExtent extent = {
                .materials = materials,
                .slab_blocks = static_cast<std::uint32_t>(needs.most_blocks)};
            EXPECT_GE(needs.most_blocks, 1U);
            EXPECT_LE(extent.samples_bytes(), bytes);
            EXPECT_LE(extent.geometry_bytes(), bytes);
            EXPECT_LE(needs.most_blocks, limits.groups_y);
            const auto up = extent.samples_bytes() + extent.geometry_bytes();
            std::uint64_t down = 0;
            std::uint64_t grid = 0;
            for (const auto* metric : two_metrics()) {
                EXPECT_LE(extent.grid_bytes(*metric), bytes);
                EXPECT_LE(extent.sums_bytes(*metric), bytes);
                down += (metric->has_slopes() ? 2 : 1) * extent.sums_bytes(*metric) +
                        extent.norms_bytes(*metric);
                grid = std::max(grid, extent.grid_bytes(*metric));
            }
            const auto on_device = 2 * (up + down) + extent.weights_bytes() + grid +
                                   extent.ranges_bytes(*two_metrics()[0]);
            EXPECT_EQ(needs.block_bytes * needs.most_blocks, on_device);
            EXPECT_LE(on_device, limits.free_bytes);
            // Copies count: what travels is there twice.
            for (const bool uploads : {false, true}) {
                for (const bool downloads : {false, true}) {
                    limits.stages_uploads = uploads;
                    limits.stages_downloads = downloads;
                    const auto staged = device_needs(limits, two_metrics(), materials);
                    EXPECT_EQ(staged.most_blocks, needs.most_blocks);
                    EXPECT_EQ(staged.block_bytes * needs.most_blocks,
                              on_device + (uploads ? 2 * up : 0) + (downloads ? 2 * down : 0));
                }
            }
            limits.stages_uploads = limits.stages_downloads = false;
        }
    }
}

TEST(DeviceNeeds, MoreThanIsFreeIsADeviceError) {
    auto limits = lavapipe_limits();
    limits.free_bytes = 64 * kMiB;
    EXPECT_NO_THROW(device_needs(limits, two_metrics(), 100));
    EXPECT_THROW(device_needs(limits, two_metrics(), 1000), Error);
    limits.free_bytes = 0;
    EXPECT_THROW(device_needs(limits, two_metrics(), 2), Error);
}

TEST(DeviceNeeds, SmallLimitsMakeSmallSlabs) {
    auto limits = lavapipe_limits();
    limits.texel_buffer_texels = 3 * 1024 * 100 * 3 / 2;  // three blocks of samples, two a texel
    EXPECT_EQ(device_needs(limits, two_metrics(), 100).most_blocks, 3U);
    limits = lavapipe_limits();
    limits.groups_y = 200;
    EXPECT_EQ(device_needs(limits, two_metrics(), 2).most_blocks, 200U);
    // weigh.comp has sixteen groups a block along x.
    limits = lavapipe_limits();
    limits.groups_x = 100;
    EXPECT_EQ(device_needs(limits, two_metrics(), 2).most_blocks, 100U / 16);
    limits.groups_x = 15;
    EXPECT_THROW(device_needs(limits, two_metrics(), 2), Error);
}

TEST(DeviceNeeds, TooManyMaterialsAreADeviceError) {
    for (const std::uint32_t materials : {4000U, 65536U}) {
        try {
            device_needs(lavapipe_limits(), two_metrics(), materials);
            FAIL() << materials;
        } catch (const Error& error) {
            EXPECT_EQ(error.fault(), Fault::device);
        }
    }
}

TEST(DeviceNeeds, TotalsCountToo) {
    const std::array<const Metric*, 1> metric = {&find_metric("rmse")};
    EXPECT_GE(device_needs(lavapipe_limits(), metric, 1000).fixed_bytes,
              std::uint64_t{1000} * 999 / 2 * sizeof(double));
}

}  // namespace
}  // namespace merl::engine
