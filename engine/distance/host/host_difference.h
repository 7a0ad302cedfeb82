#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "engine/distance/parts/error_bound.h"
#include "engine/metric/metric.h"

namespace merl::engine {

// The sums of shaders/framework/ over one block, for a device that is the processor itself: there
// the same formulas, compiled for its widest vectors, take a third of the time
// (docs/performance.md). Every number is added in the same lane and order for any width of vectors,
// so the result is the same on all processors that fuse multiplication and addition.

/// Materials that are taken together.
constexpr std::uint32_t kHostGroup = 4;

/// Float32 numbers that are added before they enter a float64 sum.
constexpr std::uint32_t kHostRun = 8;

/// The power: tests/engine/distance/host/host_difference_test.cpp. A number is added in its run and
/// in the block's sum.
constexpr Roundings kHostRoundings = {.power = 2.7e-7, .additions = kHostRun + 1};

/// The smallest and the largest number of each chunk of one block of one material.
struct ChunkRanges {
    static constexpr std::size_t kChunks = kBlockScalars / (std::size_t{4} * kChunkTexels);
    std::array<float, kChunks> low, high;
};

/// Materials against materials, each a range of consecutive ones. Both may be the same range: then
/// only the pairs above the diagonal are wanted. The sum of a row and a column, from float64, goes
/// to sums[row * stride + column]: the same bits whatever else is in the tile.
template <typename Material>
struct HostTile {
    const Material* rows;
    const Material* columns;
    std::uint32_t row_count, column_count;
    float* sums;
    std::uint32_t stride;
};

/// What difference.comp does: sums of |a - b|^degree, for the degrees 2/3, 1 and 2.
void sum_differences(double degree, const HostTile<BlockScalars>& tile);

/// What norms.comp does: the sum of |a|^degree, for the degrees 1 and 2.
float sum_norm(double degree, const BlockScalars& scalars);

/// What ranges.comp does.
void find_ranges(const BlockScalars& scalars, ChunkRanges& ranges);

/// What slopes.comp does.
void sum_slopes(const HostTile<ChunkRanges>& tile);

}  // namespace merl::engine
