#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/distance/parts/error_bound.h"
#include "engine/distance/parts/pair_tiles.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// The distance, E of Ryman 2018, equation 4.20, or that of the features of a summary, for each
/// pair of materials that is computed, in the order of its PairList, under one metric.
struct MetricDistances {
    std::vector<double> values;
    /// How far each can be from the exact value (error_bound.h); infinite where no bound is known.
    /// Of a user's summary it is an estimate (summary.h).
    std::vector<double> bounds;
    /// Of a summary, [material][window]. With these summary_distances() gives those under other
    /// parameters, which no window depends on, in microseconds.
    std::vector<WindowMean> means = {};

    bool operator==(const MetricDistances&) const = default;
};

/// What is summed over each of some consecutive blocks under one metric; all in float32.
struct PartialSums {
    std::span<const float> differences;  // [block][tile][row][column]
    std::span<const float> slopes;       // likewise, where the metric has_slopes()
    std::span<const float> norms;        // [block][material], where it has_norms()
};

/// The float64 totals of one metric over all blocks so far, and the distances that they make.
class PairTotals {
  public:
    /// For a database of `grid_voxels` voxels; tiles may have more materials. `roundings` are those
    /// of the partial sums.
    PairTotals(const Metric& metric, const PairTiles& tiles, std::uint64_t grid_voxels,
               const Roundings& roundings);

    /// Bytes of memory that this takes.
    static std::uint64_t bytes(const Metric& metric, const PairTiles& tiles);

    /// The next blocks: each pair's sums are added in the order of the voxels.
    void add(const PartialSums& sums, std::size_t blocks);

    /// After the last block. Throws Error (input) when a sum is beyond float32.
    MetricDistances distances() const;

  private:
    const Metric* metric_;
    PairTiles tiles_;
    std::uint64_t grid_voxels_;
    ErrorBound bound_;
    std::vector<double> differences_;  // [tile][row][column]
    std::vector<double> slopes_;       // likewise
    std::vector<double> norms_;        // [material]
};

}  // namespace merl::engine
