#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/database/domain.h"
#include "engine/distance/parts/block_reader.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// Some consecutive visited voxels, in whole blocks.
struct Slab {
    /// The voxels at positions [from, to) of the list.
    Slab(const Domain& domain, const VoxelList& list, std::uint64_t from, std::uint64_t to)
        : first(from),
          voxels(to - from),
          runs(list.runs(from, to)),
          geometry(voxels_of(domain, runs)) {}

    std::uint64_t first;   // position of the first voxel in the list of visited ones
    std::uint64_t voxels;  // visited
    std::vector<VoxelRun> runs;
    std::vector<Voxel> geometry;  // filled up with empty voxels

    std::uint64_t blocks() const { return block_count(voxels); }

    /// How many voxels of a block there are; the rest is empty.
    std::uint64_t filled(std::uint64_t block) const {
        return std::min<std::uint64_t>(voxels - block * kBlockVoxels, kBlockVoxels);
    }

    std::span<const Voxel, kBlockVoxels> voxels_of_block(std::uint64_t block) const {
        return std::span<const Voxel, kBlockVoxels>(geometry.data() + block * kBlockVoxels,
                                                    kBlockVoxels);
    }
};

/// The weights of a block under a metric with a twin; zero where there is no voxel.
inline void weigh_block(const Metric& metric, const Slab& slab, std::uint64_t block,
                        BlockWeights& weights) {
    metric.twin.weigh(metric.parameters, slab.voxels_of_block(block), weights);
    std::ranges::fill(std::span(weights).subspan(slab.filled(block)), 0.0);
}

}  // namespace merl::engine
