#pragma once

#include <cstdint>
#include <span>

#include "engine/device/context.h"
#include "engine/distance/parts/pair_tiles.h"
#include "engine/distance/parts/slab_reader.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// How a computation is cut into slabs: ranges of voxels for all materials, each a whole number of
/// blocks. Two slabs are in flight at a time, one being read while the other is computed.
struct SlabPlan {
    std::uint32_t materials = 0;
    std::uint32_t slab_blocks = 0;  // blocks of one slab
    std::uint64_t slabs = 0;
    std::uint64_t device_bytes = 0;  // of all buffers together
    std::uint64_t host_bytes = 0;    // of HostWork, which has no buffers
    std::uint64_t other_bytes = 0;   // of what is read, and totals of what the device computes
    bool pairs_on_host = false;      // whether metrics may be on_host()

    std::uint64_t slab_voxels() const { return std::uint64_t{slab_blocks} * kBlockVoxels; }

    /// Whether the host computes the pairs of a metric itself instead of sending them through the
    /// shaders: where the device is no other processor, for a metric with a twin and a degree.
    bool on_host(const Metric& metric) const {
        return pairs_on_host && metric.has_twin() && metric.has_bound();
    }

    PairTiles tiles(const Metric& metric) const;

    // Sizes of the buffers in bytes. Grids that the host makes there are for each metric and each
    // slab in flight; weights and grids that the device makes, and ranges, are shared by all. Of a
    // metric on_host() there is one of each.
    std::uint64_t samples_bytes() const { return slab_voxels() * materials * 3 * sizeof(double); }
    std::uint64_t geometry_bytes() const { return slab_voxels() * sizeof(Voxel); }
    std::uint64_t weights_bytes() const { return slab_voxels() * sizeof(double); }
    std::uint64_t grid_bytes(const Metric& metric) const;
    std::uint64_t ranges_bytes(const Metric& metric) const;
    std::uint64_t norms_bytes(const Metric& metric) const;
    std::uint64_t sums_bytes(const Metric& metric) const;
};

/// The largest slabs that stay within `memory_bytes`, everything counted, and every limit of the
/// device, but at least four when there is enough to do, so that reading and computing overlap.
/// With `shaders_only` nothing is on_host(). So many `threads` read, each a slab of one material at
/// a time, and the list of voxels takes `list_bytes`.
/// Throws Error (usage) when one block does not fit in memory, (device) when a limit forbids it.
SlabPlan plan_slabs(const device::Limits& limits, std::uint64_t memory_bytes,
                    std::uint64_t materials, std::uint64_t voxels,
                    std::span<const Metric* const> metrics, bool shaders_only = false,
                    std::uint64_t threads = 1, std::uint64_t list_bytes = 0);

}  // namespace merl::engine
