#include "scan/statistics/estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace merl::scan {

std::string too_few(std::uint64_t count, const char* things, std::uint64_t least) {
    return count < least ? fmt::format("{}: {}; expected {} or more", things, count, least) : "";
}

Estimate bootstrapped(double value, std::span<const double> values, const std::string& reason) {
    constexpr double none = std::numeric_limits<double>::quiet_NaN();
    if (!reason.empty()) {
        return {value, {none, none}, reason};
    }
    const auto numbers = std::ranges::count_if(values, [](double v) { return !std::isnan(v); });
    if (const auto samples =
            too_few(static_cast<std::uint64_t>(numbers), "bootstrap samples", fewest_replicates);
        !samples.empty()) {
        return {value, {none, none}, samples};
    }
    const Interval interval = percentile_interval(values);
    // Less than this is rounding.
    const double least = 1e-12 * std::max({1.0, std::abs(interval.low), std::abs(interval.high)});
    if (std::isinf(least) ? interval.low < interval.high : interval.high - interval.low > least) {
        return {value, interval};
    }
    return {value, {none, none}, "all bootstrap samples are alike"};
}

Estimate within(double least, Estimate estimate, double most) {
    auto& [low, high] = estimate.interval;
    if (estimate.too_few.empty()) {
        low = std::clamp(low, least, most);
        high = std::clamp(high, least, most);
    }
    return estimate;
}

Estimate negative(const Estimate& estimate) {
    const auto& [low, high] = estimate.interval;
    return {0 - estimate.value, {0 - high, 0 - low}, estimate.too_few};
}

bool clear_of_zero(const Estimate& estimate) {
    return estimate.interval.low > 0 || estimate.interval.high < 0;
}

}  // namespace merl::scan
