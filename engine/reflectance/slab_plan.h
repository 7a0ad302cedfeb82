#pragma once

#include <cstdint>
#include <span>

#include "engine/device/context.h"
#include "engine/reflectance/metric.h"
#include "engine/reflectance/pair_tiles.h"
#include "engine/reflectance/slab_reader.h"

namespace merl::reflectance {

/// How a computation is cut into slabs: ranges of voxels for all materials, each a whole number of
/// blocks. Two slabs are in flight at a time, one being read while the other is computed.
struct SlabPlan {
    std::uint32_t materials = 0;
    std::uint32_t slab_blocks = 0;  // blocks of one slab
    std::uint64_t slabs = 0;
    std::uint64_t device_bytes = 0;  // of all buffers together

    std::uint64_t slab_voxels() const { return std::uint64_t{slab_blocks} * kBlockVoxels; }

    PairTiles tiles(const Metric& metric) const;

    // Sizes of the buffers in bytes. Grids that the host makes there are for each metric and each
    // slab in flight; weights and grids that the device makes, and ranges, are shared by all.
    std::uint64_t samples_bytes() const { return slab_voxels() * materials * 3 * sizeof(double); }
    std::uint64_t geometry_bytes() const { return slab_voxels() * sizeof(Voxel); }
    std::uint64_t weights_bytes() const { return slab_voxels() * sizeof(double); }
    std::uint64_t grid_bytes(const Metric& metric) const;
    std::uint64_t ranges_bytes(const Metric& metric) const;
    std::uint64_t norms_bytes(const Metric& metric) const;
    std::uint64_t sums_bytes(const Metric& metric) const;
};

/// The largest slabs that stay within `memory_bytes` and every limit of the device, but at least
/// four when there is enough to do, so that reading and computing overlap.
/// Throws Error (usage) when one block does not fit in memory, (device) when a limit forbids it.
SlabPlan plan_slabs(const device::Limits& limits, std::uint64_t memory_bytes,
                    std::uint64_t materials, std::uint64_t voxels,
                    std::span<const Metric* const> metrics);

}  // namespace merl::reflectance
