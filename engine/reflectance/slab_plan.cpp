#include "engine/reflectance/slab_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/error.h"

namespace merl::reflectance {
namespace {

constexpr std::uint64_t kSlabsForOverlap = 4;
constexpr std::uint64_t kMaxMaterials = 65536;

std::uint64_t divide_up(std::uint64_t a, std::uint64_t b) {
    return (a + b - 1) / b;
}

/// Rounded up, so that what is said to be enough is enough.
std::string mebibytes(std::uint64_t bytes) {
    return fmt::format("{:.1f} MiB", std::ceil(static_cast<double>(bytes) / 104857.6) / 10);
}

}  // namespace

SlabPlan plan_slabs(const device::Limits& limits, std::uint64_t memory_bytes,
                    std::uint64_t materials, std::uint64_t voxels,
                    std::span<const Metric* const> metrics) {
    const auto tiles_across = divide_up(materials, kTile);
    const auto tiles = tiles_across * (tiles_across + 1) / 2;
    std::uint64_t groups = tiles;
    for (const auto* metric : metrics) {
        groups = std::max(groups, tiles * metric->most_groups_per_tile());
    }
    if (materials > kMaxMaterials || groups > limits.groups_x ||
        tiles_across * kTile > limits.groups_y) {
        throw Error(Fault::device,
                    fmt::format("{} materials are more than this device can pair: its "
                                "largest dispatch is {} x {} workgroups",
                                materials, limits.groups_x, limits.groups_y));
    }
    std::uint32_t block_texels = 0;
    for (const auto* metric : metrics) {
        block_texels = std::max(block_texels, metric->block_texels());
    }
    SlabPlan plan = {.materials = static_cast<std::uint32_t>(materials),
                     .padded_materials = static_cast<std::uint32_t>(tiles_across * kTile),
                     .tiles_across = static_cast<std::uint32_t>(tiles_across),
                     .tiles = static_cast<std::uint32_t>(tiles)};
    std::uint64_t sums = 0;  // buffers of pair sums that a slab in flight has
    std::uint64_t norms = 0;
    for (const auto* metric : metrics) {
        sums += metric->has_error_sums() ? 2 : 1;
        norms += metric->has_bound() ? 1 : 0;
    }
    const auto bytes_of = [&](std::uint64_t blocks) {
        plan.slab_blocks = static_cast<std::uint32_t>(blocks);
        return 2 * (plan.samples_bytes() + plan.geometry_bytes() + sums * plan.sums_bytes() +
                    norms * plan.norms_bytes()) +
               plan.weights_bytes() + plan.grid_bytes(block_texels);
    };
    const auto block_bytes = bytes_of(1);
    const auto largest = std::max({plan.samples_bytes(), plan.geometry_bytes(), plan.sums_bytes(),
                                   plan.grid_bytes(block_texels)});
    const auto buffer_limit = std::min(
        {limits.storage_buffer_bytes, limits.allocation_bytes, limits.texel_buffer_texels * 16});
    if (largest > buffer_limit) {
        throw Error(Fault::device,
                    fmt::format("{} materials need a buffer of {}, and this device allows {}",
                                materials, mebibytes(largest), mebibytes(buffer_limit)));
    }
    if (block_bytes > memory_bytes) {
        throw Error(
            Fault::usage,
            fmt::format("--memory {} bytes is too small: {} materials need at least {} ({} bytes)",
                        memory_bytes, materials, mebibytes(block_bytes), block_bytes));
    }
    const auto all_blocks = std::max<std::uint64_t>(1, divide_up(voxels, kBlockVoxels));
    const auto blocks =
        std::min({buffer_limit / largest, memory_bytes / block_bytes,
                  divide_up(all_blocks, kSlabsForOverlap), std::uint64_t{limits.groups_y}});
    plan.device_bytes = bytes_of(blocks);
    plan.slabs = divide_up(all_blocks, blocks);
    return plan;
}

}  // namespace merl::reflectance
