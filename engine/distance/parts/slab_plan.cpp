#include "engine/distance/parts/slab_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

constexpr std::uint64_t kSlabsForOverlap = 4;

/// An engine on the processor reads what it has just written from its caches, when slabs are not
/// much larger than those; much smaller ones would only cost calls.
constexpr std::uint64_t kCachedBytes = 32ULL << 20U;

/// Of a material, whatever the slabs: the states of its hashes.
constexpr std::uint64_t kMaterialBytes = 2048;

/// Rounded up, so that what is said to be enough is enough.
std::string mebibytes(std::uint64_t bytes) {
    return fmt::format("{:.1f} MiB", std::ceil(static_cast<double>(bytes) / 104857.6) / 10);
}

}  // namespace

SlabPlan plan_slabs(std::span<const EngineNeeds> engines, std::uint64_t memory_bytes,
                    const Workload& workload) {
    std::uint64_t fixed = workload.list_bytes + workload.materials * kMaterialBytes;
    std::uint64_t computed = 0;  // for a block, by the engines
    std::uint64_t most_blocks = EngineNeeds::kUnbounded;
    bool cached = false;
    for (const auto& needs : engines) {
        fixed += needs.fixed_bytes;
        computed += needs.block_bytes;
        most_blocks = std::min(most_blocks, needs.most_blocks);
        cached = cached || needs.cached;
    }
    const std::uint64_t block_bytes =
        computed + std::min(workload.threads, workload.materials) * sizeof(BlockSamples) +
        kBlockVoxels * (sizeof(Voxel) + sizeof(VoxelRun));
    const std::uint64_t least = fixed + block_bytes;
    if (least > memory_bytes) {
        throw MemoryError(
            fmt::format("{} bytes of memory is too small: {} materials need at least {} ({} bytes)",
                        memory_bytes, workload.materials, mebibytes(least), least));
    }
    const std::uint64_t all_blocks = std::max<std::uint64_t>(1, block_count(workload.voxels));
    std::uint64_t blocks = std::min({most_blocks, 1 + (memory_bytes - least) / block_bytes,
                                     (all_blocks + kSlabsForOverlap - 1) / kSlabsForOverlap});
    if (cached) {
        blocks = std::min(blocks, std::max<std::uint64_t>(
                                      1, kCachedBytes / std::max<std::uint64_t>(1, computed)));
    }
    return {.slab_blocks = static_cast<std::uint32_t>(blocks),
            .slabs = (all_blocks + blocks - 1) / blocks,
            .bytes = fixed + blocks * block_bytes};
}

}  // namespace merl::engine
