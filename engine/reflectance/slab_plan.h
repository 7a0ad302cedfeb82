#pragma once

#include <cstdint>
#include <span>

#include "engine/device/context.h"
#include "engine/reflectance/metric.h"
#include "engine/reflectance/slab_reader.h"

namespace merl::reflectance {

/// How a computation is cut into slabs: ranges of voxels for all materials, each a whole number of
/// blocks. Two slabs are in flight at a time, one being read while the other is computed.
struct SlabPlan {
    std::uint32_t materials = 0;
    std::uint32_t padded_materials = 0;  // a multiple of kTile
    std::uint32_t tiles_across = 0;      // along one side of the triangle of pairs
    std::uint32_t tiles = 0;             // of the whole triangle
    std::uint32_t slab_blocks = 0;       // blocks of one slab
    std::uint64_t slabs = 0;
    std::uint64_t device_bytes = 0;  // of all buffers together

    std::uint64_t slab_voxels() const { return std::uint64_t{slab_blocks} * kBlockVoxels; }

    // Sizes of the buffers in bytes; weights and grid are shared by the slabs in flight and by the
    // metrics.
    std::uint64_t samples_bytes() const { return slab_voxels() * materials * 3 * sizeof(double); }
    std::uint64_t geometry_bytes() const {
        return slab_voxels() * kGeometryNumbers * sizeof(double);
    }
    std::uint64_t weights_bytes() const { return slab_voxels() * sizeof(double); }
    std::uint64_t norms_bytes() const {
        return std::uint64_t{slab_blocks} * padded_materials * sizeof(float);
    }
    std::uint64_t grid_bytes(std::uint32_t block_texels) const {
        return std::uint64_t{slab_blocks} * padded_materials * block_texels * 16;
    }
    std::uint64_t sums_bytes() const {
        return std::uint64_t{slab_blocks} * tiles * kTile * kTile * sizeof(float);
    }
};

/// The largest slabs that stay within `memory_bytes` and every limit of the device, but at least
/// four when there is enough to do, so that reading and computing overlap.
/// Throws Error (usage) when one block does not fit in memory, (device) when a limit forbids it.
SlabPlan plan_slabs(const device::Limits& limits, std::uint64_t memory_bytes,
                    std::uint64_t materials, std::uint64_t voxels,
                    std::span<const Metric* const> metrics);

}  // namespace merl::reflectance
