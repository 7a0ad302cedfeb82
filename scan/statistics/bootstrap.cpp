#include "scan/statistics/bootstrap.h"

#include <algorithm>
#include <boost/random/uniform_int_distribution.hpp>
#include <cmath>
#include <limits>
#include <random>

namespace merl::scan {

double quantile(std::span<const double> sorted, double q) {
    const double place = q * static_cast<double>(sorted.size() - 1);
    const auto below = static_cast<std::size_t>(place);
    const std::size_t above = std::min(below + 1, sorted.size() - 1);
    const double share = place - static_cast<double>(below);
    // Without subtracting one infinity from another.
    if (share == 0 || sorted[below] == sorted[above]) {
        return sorted[below];
    }
    return sorted[below] * (1 - share) + sorted[above] * share;
}

std::vector<std::uint32_t> resample(std::uint64_t seed, std::uint32_t replicate,
                                    std::uint32_t clusters) {
    std::seed_seq sequence{static_cast<std::uint32_t>(seed),
                           static_cast<std::uint32_t>(seed >> 32U), replicate};
    std::mt19937_64 random(sequence);
    // The standard library's distribution may differ from one library to the next.
    const boost::random::uniform_int_distribution<std::uint32_t> draw(0, clusters - 1);
    std::vector<std::uint32_t> times(clusters);
    for (std::uint32_t i = 0; i < clusters; ++i) {
        ++times[draw(random)];
    }
    return times;
}

Interval percentile_interval(std::span<const double> values) {
    std::vector<double> sorted;
    std::ranges::copy_if(values, std::back_inserter(sorted),
                         [](double value) { return !std::isnan(value); });
    if (sorted.empty()) {
        constexpr double none = std::numeric_limits<double>::quiet_NaN();
        return {none, none};
    }
    std::ranges::sort(sorted);
    return {quantile(sorted, 0.025), quantile(sorted, 0.975)};
}

}  // namespace merl::scan
