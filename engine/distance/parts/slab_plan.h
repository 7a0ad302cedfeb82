#pragma once

#include <cstdint>
#include <span>

#include "engine/distance/parts/engine.h"

namespace merl::engine {

/// How a computation is cut into slabs: ranges of voxels for all materials, each a whole number of
/// blocks.
struct SlabPlan {
    std::uint32_t slab_blocks = 0;  // blocks of one slab
    std::uint64_t slabs = 0;
    std::uint64_t bytes = 0;  // of memory that all of it takes

    std::uint64_t slab_voxels() const { return std::uint64_t{slab_blocks} * kBlockVoxels; }
};

/// The size of a database that is to be cut.
struct Workload {
    std::uint64_t materials = 0;
    std::uint64_t voxels = 0;      // that are visited
    std::uint64_t threads = 1;     // that read, each a slab of one material at a time
    std::uint64_t list_bytes = 0;  // of the list of visited voxels
};

/// More than this many materials are not planned.
inline constexpr std::uint64_t kMaxMaterials = 65536;

/// The largest slabs that stay within `memory_bytes`, everything counted, and within what each
/// engine can do, but at least four when there is enough to do, so that reading and computing
/// overlap. Throws MemoryError when one block does not fit.
SlabPlan plan_slabs(std::span<const EngineNeeds> engines, std::uint64_t memory_bytes,
                    const Workload& workload);

}  // namespace merl::engine
