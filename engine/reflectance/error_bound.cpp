#include "engine/reflectance/error_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace merl::reflectance {
namespace {

/// Unit roundoff of float32, and what covers second-order terms.
constexpr double kRoundoff = 0x1p-24;
constexpr double kSlack = 1.01;

/// The smallest normal float32: a device may flush what is below to zero.
constexpr double kSmallest = 0x1p-126;

/// Relative error of two_thirds_power (shaders/lib/numerics.glsl; tests/engine/device_test.cpp).
constexpr double kTwoThirdsPowerError = 4e-7;

/// Texels that difference.comp adds before it adds the run.
constexpr double kRun = 8;

}  // namespace

ErrorBound::ErrorBound(const Metric& metric, std::uint64_t grid_voxels)
    : degree_(metric.header.degree), voxels_(static_cast<double>(grid_voxels)) {
    // Roundings that one term goes through: in its texel, in its run, and of the block's sum.
    const double additions = 2 + kRun + 1;
    const double evaluation =
        (degree_ < 1 ? kTwoThirdsPowerError : kRoundoff) + degree_ * kRoundoff;
    relative_ = kSlack * (additions * kRoundoff + evaluation);
    underflow_ = 3 * voxels_ * (degree_ < 1 ? std::pow(kSmallest, degree_) : kSmallest) * 2;
}

double ErrorBound::block_error(double error_sum, double norms) const {
    // The seed is at least 0.83 |d|^(-1/3) (docs/numerics.md); four scalars of a texel share the
    // largest slope and the largest sample.
    constexpr double kSteepest = 1.26 / 0.83;
    const double by_slope = kSlack * 4 * kSteepest * kRoundoff * error_sum;
    const double by_norm = kSlack * std::pow(kRoundoff, degree_) * norms;
    return std::min(by_slope, by_norm);
}

double ErrorBound::distance(double sum, double norm_a, double norm_b, double errors) const {
    if (degree_ != 2 && degree_ > 1) {
        throw std::logic_error("no error bound is known for this degree");
    }
    if (degree_ == 0) {
        return std::numeric_limits<double>::infinity();
    }
    double change = relative_ * sum + underflow_ + errors;  // of the sum
    if (degree_ == 1) {
        change += kSlack * kRoundoff * (norm_a + norm_b);
    }
    // |sqrt(x) - sqrt(y)| = |x - y| / (sqrt(x) + sqrt(y)), with y >= x - change, and <= sqrt(|x -
    // y|), which is the better one near zero.
    const double by_quotient = change / (std::sqrt(sum) + std::sqrt(std::max(0.0, sum - change)));
    double bound = sum > change ? by_quotient : std::sqrt(change);
    if (degree_ == 2) {  // E is a norm: the triangle inequality
        bound += kSlack * kRoundoff * (std::sqrt(norm_a) + std::sqrt(norm_b));
    }
    return bound / std::sqrt(voxels_) + 1e-15 * std::sqrt(sum / voxels_);
}

}  // namespace merl::reflectance
