#include "engine/distance/parts/error_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace merl::engine {
namespace {

/// What covers second-order terms.
constexpr double kSlack = 1.01;

/// The smallest normal float32: a device may flush what is below to zero.
constexpr double kSmallest = 0x1p-126;

/// Of a chunk of the slopes: how many scalars share the steepest slope and the largest sample, and
/// what the slope is off by, 1.26 for the slope and 0.966 for the seed that stands for it.
constexpr double kChunkScalars = 4.0 * kChunkTexels;
constexpr double kSteepest = 1.26 / 0.966;

}  // namespace

ErrorBound::ErrorBound(const Metric& metric, std::uint64_t grid_voxels, const Roundings& roundings)
    : degree_(metric.header.degree),
      voxels_(static_cast<double>(grid_voxels)),
      grid_(kSlack * roundings.grid) {
    const double evaluation =
        (degree_ < 1 ? roundings.power : roundings.unit) + degree_ * roundings.unit;
    relative_ = kSlack * (roundings.additions * roundings.unit + evaluation);
    underflow_ = 3 * voxels_ * (degree_ < 1 ? std::pow(kSmallest, degree_) : kSmallest) * 2;
}

double ErrorBound::distance(double sum, const Sums& sums) const {
    if (degree_ != 2 && degree_ > 1) {
        throw std::logic_error("no error bound is known for this degree");
    }
    if (degree_ == 0) {
        return std::numeric_limits<double>::infinity();
    }
    double change = relative_ * sum + underflow_;  // of the sum
    if (degree_ < 1) {
        change += grid_ * kChunkScalars * kSteepest * sums.slopes;
    } else if (degree_ == 1) {
        change += grid_ * (sums.norm_a + sums.norm_b);
    }
    // |sqrt(x) - sqrt(y)| = |x - y| / (sqrt(x) + sqrt(y)), with y >= x - change, and <= sqrt(|x -
    // y|), which is the better one near zero.
    const double by_quotient = change / (std::sqrt(sum) + std::sqrt(std::max(0.0, sum - change)));
    double bound = sum > change ? by_quotient : std::sqrt(change);
    if (degree_ == 2) {  // E is a norm: the triangle inequality
        bound += grid_ * (std::sqrt(sums.norm_a) + std::sqrt(sums.norm_b));
    }
    return bound / std::sqrt(voxels_) + 1e-15 * std::sqrt(sum / voxels_);
}

}  // namespace merl::engine
