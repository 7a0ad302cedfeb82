#pragma once

#include <cstdint>

namespace merl::scan {

/// A planned experiment: every judge votes once on every configuration. Votes are independent; each
/// is for the same metric with probability `right`, "equal" with probability `equal`, and otherwise
/// for the other metric.
struct PlannedExperiment {
    std::uint32_t judges;
    std::uint32_t configurations;
    double right;
    double equal;
};

/// What to expect of it, with the one-sided test of uniform_test.h at a level of significance.
struct Power {
    double alone;       ///< the probability that a configuration is significant by itself
    double holm_any;    ///< that with Holm's correction at least one of them is
    double holm_share;  ///< the expected share of configurations that is, with Holm's correction
};

/// Exact, without simulation. Requires at least one judge and one configuration, and probabilities
/// that add up to 1 or less. O(judges * configurations^2) and less where few can be significant.
Power power_of(const PlannedExperiment& plan, double alpha);

}  // namespace merl::scan
