#include "engine/distance/parts/slab_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "engine/base/error.h"
#include "engine/distance/host/host_difference.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kSlabsForOverlap = 4;
constexpr std::uint64_t kMaxMaterials = 65536;

/// Materials along a side of a tile of HostWork: as many blocks of them as stay in the processor's
/// nearest caches.
constexpr std::uint32_t kHostTile = 20;
static_assert(kHostTile % kHostGroup == 0);

/// A device that is the processor itself reads what it has just written from its caches, when slabs
/// are not much larger than those; much smaller ones would only cost submissions.
constexpr std::uint64_t kCachedBytes = 32ULL << 20U;

/// Of a material, whatever the slabs: the states of its hashes.
constexpr std::uint64_t kMaterialBytes = 2048;

template <typename T>
T divide_up(T a, std::type_identity_t<T> b) {
    return (a + b - 1) / b;
}

/// Rounded up, so that what is said to be enough is enough.
std::string mebibytes(std::uint64_t bytes) {
    return fmt::format("{:.1f} MiB", std::ceil(static_cast<double>(bytes) / 104857.6) / 10);
}

/// Of PairTotals.
std::uint64_t totals_bytes(const SlabPlan& plan, const Metric& metric) {
    const auto tiles = plan.tiles(metric);
    const std::uint64_t pairs = tiles.count() * tiles.pairs_of_tile();
    return ((metric.has_slopes() ? 2 : 1) * pairs +
            (metric.has_norms() ? tiles.padded_materials() : 0)) *
           sizeof(double);
}

}  // namespace

PairTiles SlabPlan::tiles(const Metric& metric) const {
    return on_host(metric) ? PairTiles::covering(materials, kHostTile)
                           : PairTiles::best(materials, metric);
}

std::uint64_t SlabPlan::grid_bytes(const Metric& metric) const {
    const auto rows = on_host(metric) ? materials : tiles(metric).padded_materials();
    return std::uint64_t{slab_blocks} * rows * metric.block_texels() * 16;
}

std::uint64_t SlabPlan::ranges_bytes(const Metric& metric) const {
    if (!metric.has_slopes()) {
        return 0;
    }
    return on_host(metric) ? grid_bytes(metric) / sizeof(BlockScalars) * sizeof(ChunkRanges)
                           : grid_bytes(metric) / kChunkTexels / 2;
}

std::uint64_t SlabPlan::norms_bytes(const Metric& metric) const {
    return metric.has_norms() ? std::uint64_t{slab_blocks} * tiles(metric).padded_materials() * 4
                              : 0;
}

std::uint64_t SlabPlan::sums_bytes(const Metric& metric) const {
    const auto t = tiles(metric);
    return std::uint64_t{slab_blocks} * t.count() * t.pairs_of_tile() * sizeof(float);
}

SlabPlan plan_slabs(const device::Limits& limits, std::uint64_t memory_bytes,
                    std::uint64_t materials, std::uint64_t voxels,
                    std::span<const Metric* const> metrics, bool shaders_only,
                    std::uint64_t threads, std::uint64_t list_bytes) {
    if (materials > kMaxMaterials) {
        throw Error(Fault::device,
                    fmt::format("{} materials are more than {}, the most there may be", materials,
                                kMaxMaterials));
    }
    SlabPlan plan = {.materials = static_cast<std::uint32_t>(materials),
                     .pairs_on_host = limits.is_host && !shaders_only};
    for (const auto* metric : metrics) {
        if (plan.on_host(*metric)) {
            continue;
        }
        const auto tiles = plan.tiles(*metric);
        const auto groups =
            std::uint64_t{tiles.count()} * (metric->has_row_groups() ? tiles.side : 1);
        if (groups > limits.groups_x || tiles.padded_materials() > limits.groups_y) {
            throw Error(Fault::device,
                        fmt::format("{} materials are more than this device can pair: its "
                                    "largest dispatch is {} x {} workgroups",
                                    materials, limits.groups_x, limits.groups_y));
        }
    }
    std::uint64_t largest = 1;  // buffer
    const auto bytes_of = [&](std::uint64_t blocks) {
        plan.slab_blocks = static_cast<std::uint32_t>(blocks);
        std::uint64_t per_slab = 0;  // in flight
        std::uint64_t device_grid = 0;
        std::uint64_t ranges = 0;
        plan.host_bytes = 0;
        plan.other_bytes = list_bytes + materials * kMaterialBytes +
                           std::min(threads, materials) * blocks * sizeof(BlockSamples) +
                           plan.slab_voxels() * (sizeof(Voxel) + sizeof(VoxelRun));
        largest = 1;
        for (const auto* metric : metrics) {
            const auto grid = plan.grid_bytes(*metric);
            const auto sums = plan.sums_bytes(*metric);
            const auto all_sums = (metric->has_slopes() ? 2 : 1) * sums + plan.norms_bytes(*metric);
            if (plan.on_host(*metric)) {
                plan.host_bytes += plan.weights_bytes() + grid + plan.ranges_bytes(*metric) +
                                   all_sums + totals_bytes(plan, *metric);
                continue;
            }
            plan.other_bytes += totals_bytes(plan, *metric);
            if (metric->has_twin()) {
                per_slab += grid;
                plan.other_bytes += 2 * plan.weights_bytes();
            } else {
                device_grid = std::max(device_grid, grid);
            }
            ranges = std::max(ranges, plan.ranges_bytes(*metric));
            per_slab += all_sums;
            largest = std::max({largest, grid, sums});
        }
        plan.device_bytes = 2 * per_slab + ranges;
        if (device_grid > 0) {
            largest = std::max({largest, plan.samples_bytes(), plan.geometry_bytes()});
            plan.device_bytes += 2 * (plan.samples_bytes() + plan.geometry_bytes()) +
                                 plan.weights_bytes() + device_grid;
        }
        return plan.device_bytes + plan.host_bytes + plan.other_bytes;
    };
    // What one more block takes: totals are there once.
    const auto two_blocks_bytes = bytes_of(2);
    const auto two_blocks_other = plan.other_bytes;
    const auto block_bytes = bytes_of(1);
    const auto more_bytes = two_blocks_bytes - block_bytes;
    const auto computed_bytes =
        std::max<std::uint64_t>(1, more_bytes - (two_blocks_other - plan.other_bytes));
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
    const auto all_blocks = std::max<std::uint64_t>(1, block_count(voxels));
    auto blocks = std::min({buffer_limit / largest, 1 + (memory_bytes - block_bytes) / more_bytes,
                            divide_up(all_blocks, kSlabsForOverlap)});
    if (plan.device_bytes > 0) {
        blocks = std::min(blocks, std::uint64_t{limits.groups_y});
    }
    if (limits.is_host) {
        blocks = std::min(blocks, std::max<std::uint64_t>(1, kCachedBytes / computed_bytes));
    }
    bytes_of(blocks);
    plan.slabs = divide_up(all_blocks, blocks);
    return plan;
}

}  // namespace merl::engine
