#pragma once

#include <cstdint>

#include "engine/reflectance/metric.h"

namespace merl::reflectance {

/// How far a distance computed on the device can be from the exact one. docs/numerics.md derives
/// every term; tests/engine/error_bound_test.cpp holds them to float64.
class ErrorBound {
  public:
    /// For a database of `grid_voxels` voxels.
    ErrorBound(const Metric& metric, std::uint64_t grid_voxels);

    /// Of one block and pair with a degree below one: how much the rounding of samples can change
    /// the sum. `error_sum` is what difference.comp gave, `norms` the two materials' norms.
    double block_error(double error_sum, double norms) const;

    /// Of a distance: `sum` is the total over all blocks, `norm_a` and `norm_b` the materials' sums
    /// of h from zero, `errors` the total of block_error(). Infinite for a metric without a degree.
    double distance(double sum, double norm_a, double norm_b, double errors) const;

  private:
    double degree_;
    double voxels_;
    double relative_;   // of the sum, from evaluating and adding differences
    double underflow_;  // of the sum, from numbers below the range of float32
};

}  // namespace merl::reflectance
