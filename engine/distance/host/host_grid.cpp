#include "engine/distance/host/host_grid.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "engine/base/widest_vectors.h"

namespace merl::engine {
namespace {

/// A texel is a voxel's three channels and its weight.
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
    // Of voxels that are not there a transform may make NaN.
    const auto clear = [=](auto&& channel) {
        std::fill(channel.begin() + static_cast<std::ptrdiff_t>(filled), channel.end(), 0);
    };
    if (metric.has_bound()) {
        metric.twin.scale(metric.parameters, voxels, samples, weights,
                          texels.first<kBlockScalars>());
        for (std::size_t c = 0; c < samples.size(); ++c) {
            clear(texels.subspan(c * kBlockVoxels, kBlockVoxels));
        }
        return;
    }
    thread_local BlockSamples transformed;
    metric.twin.transform(metric.parameters, voxels, samples, transformed);
    std::ranges::for_each(transformed, clear);
    write_voxels(transformed, weights.data(), texels.data());
}

}  // namespace merl::engine
