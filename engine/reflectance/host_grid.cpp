#include "engine/reflectance/host_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/widest_vectors.h"

namespace merl::reflectance {
namespace {

/// With a degree: a channel after the other, as in channel_texel().
MERL_SCAN_WIDEST_VECTORS void write_channel(const double* samples, const double* weights,
                                            float* texels) {
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        texels[k] = static_cast<float>(samples[k] * weights[k]);
    }
}

/// Without: a texel is a voxel's three channels and its weight.
MERL_SCAN_WIDEST_VECTORS void write_voxels(const BlockSamples& samples, const double* weights,
                                           float* texels) {
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        texels[4 * k] = static_cast<float>(samples[0][k]);
        texels[4 * k + 1] = static_cast<float>(samples[1][k]);
        texels[4 * k + 2] = static_cast<float>(samples[2][k]);
        texels[4 * k + 3] = static_cast<float>(weights[k]);
    }
}

}  // namespace

void fold_weights(const Metric& metric, const Slab& slab, std::span<BlockWeights> weights) {
    const double power = metric.has_bound() ? 1 / metric.header.degree : 1;
    tbb::parallel_for(std::uint64_t{0}, slab.blocks(), [&](std::uint64_t block) {
        auto& of_block = weights[block];
        metric.twin.weigh(metric.parameters, slab.voxels_of_block(block), of_block);
        const auto there = std::span(of_block).first(slab.filled(block));
        std::ranges::transform(there, there.begin(),
                               [=](double weight) { return std::pow(weight, power); });
        std::ranges::fill(std::span(of_block).subspan(there.size()), 0.0);
    });
}

void make_grid(const Metric& metric, std::span<const Voxel, kBlockVoxels> voxels,
               std::uint64_t filled, const BlockWeights& weights, const BlockSamples& samples,
               std::span<float> texels) {
    thread_local BlockSamples transformed;
    metric.twin.transform(metric.parameters, voxels, samples, transformed);
    for (auto& channel : transformed) {  // of voxels that are not there a transform may make NaN
        std::fill(channel.begin() + static_cast<std::ptrdiff_t>(filled), channel.end(), 0.0);
    }
    if (!metric.has_bound()) {
        write_voxels(transformed, weights.data(), texels.data());
        return;
    }
    for (std::size_t c = 0; c < transformed.size(); ++c) {
        write_channel(transformed[c].data(), weights.data(), texels.data() + c * kBlockVoxels);
    }
}

}  // namespace merl::reflectance
