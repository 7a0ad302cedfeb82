#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scan/statistics/bootstrap.h"
#include "scan/statistics/estimate.h"

namespace merl::scan {

/// A number from 0 to 1 that one judge gave to one configuration.
struct CrossedValue {
    std::uint32_t judge;
    std::uint32_t configuration;
    double value;
};

/// The mean of values as it would be with other judges and other materials, both as clusters: how
/// its logarithm of odds changes when one judge, or one material with all its configurations, is
/// left out (the jackknife), with Student's t for as many as there are of either kind
/// (docs/experiment.md).
class CrossedShare {
  public:
    /// `materials` has those of each configuration, 0 to `material_count` - 1, each once.
    CrossedShare(std::span<const CrossedValue> values, std::uint32_t judges,
                 std::span<const std::vector<std::uint32_t>> materials,
                 std::uint32_t material_count);

    /// The mean with its 95 % interval. There is none for the reason given, if it is not empty;
    /// where nothing changes whoever is left out; and where one is in all values.
    Estimate estimate(const std::string& reason = {}) const;

    /// Two-sided, that the mean is this: 1 less the level of the interval that ends there. Requires
    /// that there is an interval.
    double p_value(double mean) const;

  private:
    /// Judges, or materials.
    struct Clusters {
        double count = 0;        ///< those with values
        double variance = 0;     ///< of the logarithm of the odds
        double most_change = 0;  ///< of the mean, when one is left out; infinite if none is left
    };

    Clusters leave_out(std::span<const double> sums, std::span<const double> counts) const;

    /// Of the interval whose level is 1 - `p`, in the logarithm of the odds.
    double half_width(double p) const;

    double sum_ = 0;
    double count_ = 0;
    Clusters judges_;
    Clusters materials_;
};

}  // namespace merl::scan
