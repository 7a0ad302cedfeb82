#include "engine/distance/parts/twin_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace merl::engine {

void fold_weights(const Metric& metric, const Slab& slab, std::span<BlockWeights> weights) {
    tbb::parallel_for(std::uint64_t{0}, slab.blocks(), [&](std::uint64_t block) {
        weigh_block(metric, slab, block, weights[block]);
        if (metric.has_degree()) {
            const double power = 1 / metric.header.degree;
            std::ranges::transform(weights[block], weights[block].begin(),
                                   [=](double weight) { return std::pow(weight, power); });
        }
    });
}

void make_scalars(const Metric& metric, const Slab& slab, std::uint64_t block,
                  const BlockWeights& weights, const BlockSamples& samples,
                  std::span<float, kBlockScalars> scalars) {
    metric.twin.scale(metric.parameters, slab.voxels_of_block(block), samples, weights, scalars);
    for (std::size_t c = 0; c < samples.size(); ++c) {
        // Of voxels that are not there a transform may make NaN.
        const auto channel = scalars.subspan(c * kBlockVoxels, kBlockVoxels);
        std::ranges::fill(channel.subspan(slab.filled(block)), 0.0F);
    }
}

void make_weighted(const Metric& metric, const Slab& slab, std::uint64_t block,
                   const BlockWeights& weights, const BlockSamples& samples,
                   std::span<float, std::size_t{4} * kBlockVoxels> weighted) {
    BlockSamples transformed;
    metric.twin.transform(metric.parameters, slab.voxels_of_block(block), samples, transformed);
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        const bool is_there = k < slab.filled(block);
        for (std::size_t c = 0; c < samples.size(); ++c) {
            weighted[4 * k + c] = is_there ? static_cast<float>(transformed[c][k]) : 0.0F;
        }
        weighted[4 * k + 3] = static_cast<float>(weights[k]);
    }
}

}  // namespace merl::engine
