#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <utility>
#include <vector>

namespace merl::scan {

/// A percentile interval; not a number where there is none.
struct Interval {
    double low;
    double high;
};

/// How many bootstrap samples, and which.
struct BootstrapOptions {
    std::uint32_t replicates = 1000;  ///< 0: no intervals
    std::uint64_t seed = 1;
};

/// Fewer clusters than this say too little about how clusters differ for an interval: of four, one
/// bootstrap sample in 256 is the same cluster four times, of three one in 27, which is more than
/// the 2.5 % that an interval leaves out at either end.
inline constexpr std::uint32_t fewest_clusters = 5;

/// With fewer bootstrap samples the 2.5 % at either end are less than one of them.
inline constexpr std::uint32_t fewest_replicates = 39;

/// So many samples are drawn between two calls of progress.
inline constexpr std::uint32_t replicates_per_update = 64;

/// How often each of `clusters` clusters is in bootstrap sample `replicate`: as many are drawn,
/// with replacement. The same for the same seed on every machine; samples do not depend on each
/// other.
std::vector<std::uint32_t> resample(std::uint64_t seed, std::uint32_t replicate,
                                    std::uint32_t clusters);

/// A quantile of ascending values, with linear interpolation between order statistics (type 7 of
/// Hyndman and Fan 1996, as numpy has it). Requires at least one value, and 0 <= q <= 1.
double quantile(std::span<const double> sorted, double q);

/// The middle 95 % of the values: from quantile 0.025 to 0.975. Values that are not numbers are
/// left out; infinities are values like others.
Interval percentile_interval(std::span<const double> values);

}  // namespace merl::scan
