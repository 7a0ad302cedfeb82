#pragma once

#include <cstdint>
#include <span>

#include "scan/pairs/pairs.h"

namespace merl::scan {

/// Whether two metrics disagree on the order of the pairs a and b: the signs of D1(a) - D1(b) and
/// D2(a) - D2(b) differ, sgn in {-1, 0, 1} (docs/numerics.md). A tie in just one metric is a
/// disagreement. `d1a` is the distance of pair a under the first metric, and so on.
constexpr bool disagree(double d1a, double d1b, double d2a, double d2b) {
    return (d1a < d1b) != (d2a < d2b) || (d1a > d1b) != (d2a > d2b);
}

/// The agreement of two metrics on the pairs a and b (docs/numerics.md), in [0, 1]; low is a strong
/// disagreement:
///
///     min(D1(a) D2(b), D1(b) D2(a)) / max(the same two products)
///
/// Distances must be finite and not negative. For products within 2^-500 and 2^500 this is that
/// formula in float64, bit for bit. Beyond, the products neither overflow nor underflow: the result
/// is what the same roundings give with an unlimited range of exponents, and only the quotient may
/// underflow.
///
/// When both products are 0 a disagreement is a tie at 0 in exactly one metric, and the agreement
/// is the smaller over the larger of the other metric's two distances: the limit for two equal
/// distances that go to 0 together. What is left is no disagreement and gives 1.
///
/// Of two disagreements whose left pair (see Configuration) has the smaller first and the larger
/// second distance, the result never grows when the left pair's first or the right pair's second
/// distance shrinks, or one of the other two grows: rounding is monotone. The best-first search
/// stands on this.
double agreement(double d1a, double d1b, double d2a, double d2b);

/// A disagreement, as indices of pairs. The left pair has the smaller first and the larger second
/// distance; where one of the two ties, the other decides (docs/numerics.md).
struct Configuration {
    std::uint32_t left;
    std::uint32_t right;
    double agreement;
    bool operator==(const Configuration&) const = default;
};

/// The configuration of pairs a and b, oriented, from every pair's distance under the first and
/// the second metric. Requires that the metrics disagree on it.
Configuration make_configuration(std::span<const double> first, std::span<const double> second,
                                 std::uint32_t a, std::uint32_t b);

/// The same of two metrics that are together.
inline Configuration make_configuration(const Distances& distances, std::uint32_t a,
                                        std::uint32_t b) {
    return make_configuration(distances.first, distances.second, a, b);
}

/// The total order of disagreements (docs/numerics.md): ascending agreement, then pair order, the
/// earlier pair of the configuration first.
struct StrongerFirst {
    bool operator()(const Configuration& x, const Configuration& y) const;
};

}  // namespace merl::scan
