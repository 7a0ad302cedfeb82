#pragma once

#include <span>
#include <string>

#include "scan/statistics/bootstrap.h"

namespace merl::scan {

/// A figure and its 95 % interval.
struct Estimate {
    double value;
    Interval interval;
    std::string too_few = {};  ///< why there is no interval, where there is none
};

/// What there is too little of for an interval, as "judges: 3; expected 5 or more". Empty if there
/// is enough of it.
std::string too_few(std::uint64_t count, const char* things, std::uint64_t least = fewest_clusters);

/// Why there is no interval where nothing is known of how far off a figure could be.
inline constexpr const char* all_alike = "all judgements are alike";

/// A figure with the percentile interval of its bootstrapped values; without one for the reason
/// given, if it is not empty, and where there are fewer than fewest_replicates values or all of
/// them are the same: that is no certainty, but the lack of anything that could differ.
Estimate bootstrapped(double value, std::span<const double> values, const std::string& reason = {});

/// The estimate with an interval that does not go beyond what the figure can be.
Estimate within(double least, Estimate estimate, double most = 1);

/// The estimate of minus the figure.
Estimate negative(const Estimate& estimate);

/// Whether there is an interval and it leaves out 0.
bool clear_of_zero(const Estimate& estimate);

}  // namespace merl::scan
