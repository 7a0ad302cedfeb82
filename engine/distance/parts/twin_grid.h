#pragma once

#include <cstdint>
#include <span>

#include "engine/distance/parts/slab.h"
#include "engine/metric/metric.h"

namespace merl::engine {

// What the host makes of samples with a metric's twin, in float64 and rounded once: what
// prepare.comp and weigh.comp make on a device, in the same order.

/// What the samples at each voxel of a slab are multiplied with before they enter the grid:
/// weight^(1/degree), which the difference turns into the weight again; without a degree the weight
/// itself. Zero where there is no voxel. On all threads.
void fold_weights(const Metric& metric, const Slab& slab, std::span<BlockWeights> weights);

/// One block of one material in the grid of a metric with a degree. Zero where there is no voxel.
void make_scalars(const Metric& metric, const Slab& slab, std::uint64_t block,
                  const BlockWeights& weights, const BlockSamples& samples,
                  std::span<float, kBlockScalars> scalars);

/// Likewise without a degree: of each voxel the transformed sample and the weight.
void make_weighted(const Metric& metric, const Slab& slab, std::uint64_t block,
                   const BlockWeights& weights, const BlockSamples& samples,
                   std::span<float, std::size_t{4} * kBlockVoxels> weighted);

}  // namespace merl::engine
