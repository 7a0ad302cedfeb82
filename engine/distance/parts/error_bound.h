#pragma once

#include <cstdint>

#include "engine/metric/metric.h"

namespace merl::engine {

/// What differences are rounded by where they are computed.
struct Roundings {
    double power;           // relative error of |d|^(2/3)
    double additions;       // most roundings that one number goes through when it is added
    double unit = 0x1p-24;  // the most that rounding changes a number by, relative to it
    double grid = 0x1p-24;  // likewise where the grid is made
};

/// How far a distance computed in float32 can be from the exact one. docs/numerics.md derives
/// every term; tests/engine/distance/parts/error_bound_test.cpp holds them to float64.
class ErrorBound {
  public:
    /// For a database of `grid_voxels` voxels.
    ErrorBound(const Metric& metric, std::uint64_t grid_voxels, const Roundings& roundings);

    /// What is summed beside a distance, over all voxels; 0 where the metric has no such sum.
    struct Sums {
        double norm_a = 0;  // of h from zero, of each material
        double norm_b = 0;
        double slopes = 0;  // of chunks (docs/numerics.md)
    };

    /// Of a distance whose sum of h is `sum`. Infinite for a metric without a degree.
    double distance(double sum, const Sums& sums) const;

  private:
    double degree_;
    double voxels_;
    double grid_;       // relative error of the grid's numbers
    double relative_;   // of the sum, from evaluating and adding differences
    double underflow_;  // of the sum, from numbers below the range of float32
};

}  // namespace merl::engine
