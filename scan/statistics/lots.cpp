#include "scan/statistics/lots.h"

#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <vector>

namespace merl::scan {

double at_least_by_lot(std::uint64_t n, std::uint64_t k, double p) {
    if (k == 0 || n == 0) {
        return k == 0 ? 1 : 0;
    }
    const boost::math::binomial_distribution<double> draws(static_cast<double>(n), p);
    return k > n ? 0 : boost::math::cdf(complement(draws, static_cast<double>(k - 1)));
}

double at_most_by_lot(std::uint64_t n, std::uint64_t k, double p) {
    if (k >= n) {
        return 1;
    }
    const boost::math::binomial_distribution<double> draws(static_cast<double>(n), p);
    return boost::math::cdf(draws, static_cast<double>(k));
}

double run_by_lot(std::uint64_t n, std::uint64_t length) {
    if (length <= 1 || n < length) {
        return length <= 1 && n >= length ? 1 : 0;
    }
    // From the second throw on each is as the one before with probability 1/2: a run of so many
    // throws is one of `k` such likenesses in a row among `m`.
    const std::uint64_t m = n - 1;
    const std::uint64_t k = length - 1;
    const double all_alike = std::exp2(-static_cast<double>(k));
    std::vector<double> without(m + 1, 1.0);  // the probability of none among so many
    double probability = all_alike;           // that the first run is complete by then
    without[k] = 1 - probability;
    for (std::uint64_t i = k + 1; i <= m; ++i) {
        // It is complete just here: k likenesses after an unlikeness, and no run before that.
        probability += all_alike / 2 * without[i - k - 1];
        without[i] = 1 - probability;
    }
    return probability;
}

}  // namespace merl::scan
