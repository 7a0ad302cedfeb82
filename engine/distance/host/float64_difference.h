#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "engine/metric/metric.h"

namespace merl::engine {

// The sums of float64_distances() over one channel of one block. Every operation rounds once and
// every number is added in the same lane and order for any width of vectors, so the result has the
// same bits on all processors; those without fused multiplication and addition get it from fma().

/// Materials that are taken together.
constexpr std::size_t kFloat64Columns = 4;

/// One channel of a block of one material, transformed.
using ChannelSamples = std::array<double, kBlockVoxels>;

/// Sums of w |a - b|^degree over the voxels, for the degrees 2/3, 1 and 2: of a row against each of
/// up to kFloat64Columns columns, into as many `sums`. The relative error is at most 135 roundings
/// (docs/numerics.md), of which the power takes 3.1, where neither what is subtracted nor the
/// result is below 2^-1022.
void sum_float64_differences(double degree, const ChannelSamples& row,
                             std::span<const ChannelSamples* const> columns,
                             const BlockWeights& weights, std::span<double> sums);

}  // namespace merl::engine
