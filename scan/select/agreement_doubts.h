#pragma once

#include <span>
#include <vector>

#include "scan/pairs/agreement.h"

namespace merl::scan {

/// Whether a bound is more than a thousandth of the least that the exact distance can be. Such a
/// distance is refined before it is compared: it would be contested with everything.
bool is_loose(double value, double bound);

/// How far the agreements of configurations may be from those of exact distances.
class AgreementDoubts {
  public:
    /// The distances of all pairs under two metrics, and their bounds.
    AgreementDoubts(std::span<const double> first, std::span<const double> first_bounds,
                    std::span<const double> second, std::span<const double> second_bounds);

    /// The pairs with a loose distance, or two bounds that are loose together. They count as exact
    /// here, since they are refined anyway before a comparison stands.
    const std::vector<bool>& loose() const { return loose_; }

    /// Whether there are no others with a doubt.
    bool none() const { return worst_ == 0; }

    /// Whether the exact agreement of a later one may be no greater than that of one that is taken.
    bool may_come_before(const Configuration& later, const Configuration& taken) const;

    /// Whether nothing of the agreement of a later one, or a greater agreement, may come before one
    /// that is taken.
    bool surely_after(const Configuration& later, const Configuration& taken) const;

  private:
    double doubt(const Configuration& c) const;
    double greatest(const Configuration& c) const;

    std::vector<double> doubt_;  // per pair: the relative bounds of its two distances together
    std::vector<bool> loose_;
    double worst_ = 0;
};

}  // namespace merl::scan
