#include "scan/select/agreement_doubts.h"

#include <algorithm>
#include <cstddef>

namespace merl::scan {
namespace {

constexpr double most_relative = 1e-3;

/// Relative error of an agreement computed from four exact distances, with room.
constexpr double rounding = 1e-15;

/// A bound relative to the least that the exact distance can be.
double relative(double value, double bound) {
    return bound == 0 ? 0 : bound / std::max(value - bound, bound * 1e-6);
}

/// Also of what is no number, from an infinite bound.
bool is_loose(double relative_bound) {
    return !(relative_bound <= most_relative);
}

}  // namespace

bool is_loose(double value, double bound) {
    return is_loose(relative(value, bound));
}

AgreementDoubts::AgreementDoubts(std::span<const double> first,
                                 std::span<const double> first_bounds,
                                 std::span<const double> second,
                                 std::span<const double> second_bounds)
    : doubt_(first.size()), loose_(first.size()) {
    for (std::size_t pair = 0; pair < first.size(); ++pair) {
        const double doubt =
            relative(first[pair], first_bounds[pair]) + relative(second[pair], second_bounds[pair]);
        loose_[pair] = is_loose(doubt);
        doubt_[pair] = loose_[pair] ? 0 : doubt;
        worst_ = std::max(worst_, doubt_[pair]);
    }
}

/// To first order and with room for the second.
double AgreementDoubts::doubt(const Configuration& c) const {
    return 1.01 * (doubt_[c.left] + doubt_[c.right]) + rounding;
}

double AgreementDoubts::greatest(const Configuration& c) const {
    return c.agreement * (1 + doubt(c));
}

bool AgreementDoubts::may_come_before(const Configuration& later,
                                      const Configuration& taken) const {
    return later.agreement * (1 - doubt(later)) <= greatest(taken);
}

bool AgreementDoubts::surely_after(const Configuration& later, const Configuration& taken) const {
    return later.agreement * (1 - 2.02 * worst_ - rounding) > greatest(taken);
}

}  // namespace merl::scan
