#include "scan/statistics/sign_test.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <numeric>

namespace merl::scan {

double sign_test(std::uint64_t a, std::uint64_t b) {
    if (a == b) {
        return 1;
    }
    const boost::math::binomial_distribution<double> coin(static_cast<double>(a + b), 0.5);
    return std::min(1.0, 2 * boost::math::cdf(coin, static_cast<double>(std::min(a, b))));
}

std::vector<double> holm(std::span<const double> p_values) {
    std::vector<std::size_t> order(p_values.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return p_values[i]; });
    std::vector<double> adjusted(p_values.size());
    double largest = 0;
    for (std::size_t rank = 0; rank < order.size(); ++rank) {
        const double p = static_cast<double>(order.size() - rank) * p_values[order[rank]];
        largest = std::max(largest, std::min(1.0, p));
        adjusted[order[rank]] = largest;
    }
    return adjusted;
}

}  // namespace merl::scan
