#pragma once

#include <cstdint>
#include <span>

#include "engine/distance/parts/slab_reader.h"
#include "engine/metric/metric.h"

namespace merl::engine {

// A metric's grid made on the host by its float64 twin. For every metric that has one: there are
// only as many transforms as samples, the processor takes them while it reads the samples anyway,
// and every device gets the same grid. What weigh.comp and prepare.comp do on the device for a
// user's metric is the same.

/// What the samples at each voxel of a slab are multiplied with before they enter the grid:
/// weight^(1/degree), which the difference turns into the weight again. Without a degree the weight
/// itself, which the grid holds beside the samples. Zero where there is no
/// voxel.
void fold_weights(const Metric& metric, const Slab& slab, std::span<BlockWeights> weights);

/// The texels of one block of one material (shaders/framework/metric.glsl), rounded once from
/// float64: metric.block_texels() of four numbers each. Zero from voxel `filled` on.
void make_grid(const Metric& metric, std::span<const Voxel, kBlockVoxels> voxels,
               std::uint64_t filled, const BlockWeights& weights, const BlockSamples& samples,
               std::span<float> texels);

}  // namespace merl::engine
