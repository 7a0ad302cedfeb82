#include "scan/statistics/power.h"

#include <algorithm>
#include <boost/math/distributions/binomial.hpp>
#include <cmath>
#include <vector>

#include "scan/statistics/uniform_test.h"

namespace merl::scan {
namespace {

/// A thousand cases as likely as this change no figure.
constexpr double negligible = 1e-15;

/// The probabilities of the sums n to 3n of n votes.
std::vector<double> sums_of(const PlannedExperiment& plan) {
    const double wrong = std::max(0.0, 1 - plan.right - plan.equal);
    std::vector<double> sums = {1};
    for (std::uint32_t n = 0; n < plan.judges; ++n) {
        std::vector<double> next(sums.size() + 2);
        for (std::size_t s = 0; s < sums.size(); ++s) {
            next[s] += sums[s] * wrong;
            next[s + 1] += sums[s] * plan.equal;
            next[s + 2] += sums[s] * plan.right;
        }
        sums = std::move(next);
    }
    return sums;
}

}  // namespace

Power power_of(const PlannedExperiment& plan, double alpha) {
    const UniformVotes test(plan.judges);
    const auto sums = sums_of(plan);
    const std::uint32_t all = plan.configurations;
    // Sums from the largest on, so p-values from the smallest on. reached[c] is the probability
    // that c configurations have the p-values so far, all of them rejected. Holm (1979) rejects the
    // i-th smallest, counted from 0, while p <= alpha / (all - i); equal ones stand or fall with
    // the first of them, because the bound grows.
    std::vector<double> reached(all + 1);
    reached[0] = 1;
    double left = 1;  // the probability of the sums that are still to come
    double rejected = 0;
    Power power{.alone = 0, .holm_any = 0, .holm_share = 0};
    for (std::size_t s = sums.size(); s-- > 0;) {
        const double p = test.at_least(plan.judges + s);
        if (p > alpha) {
            break;
        }
        power.alone += sums[s];
        const double share = left > 0 ? std::clamp(sums[s] / left, 0.0, 1.0) : 1;
        left -= sums[s];
        std::vector<double> next(all + 1);
        for (std::uint32_t c = 0; c <= all; ++c) {
            if (reached[c] < negligible) {
                continue;
            }
            const std::uint32_t rest = all - c;
            if (rest == 0) {
                next[c] += reached[c];
                continue;
            }
            const boost::math::binomial_distribution<double> more(rest, share);
            if (p <= alpha / rest) {
                for (std::uint32_t x = 0; x <= rest; ++x) {
                    next[c + x] += reached[c] * boost::math::pdf(more, x);
                }
            } else {
                // Where one more has this p-value, it ends here with c.
                const double none = boost::math::pdf(more, 0);
                next[c] += reached[c] * none;
                rejected += reached[c] * (1 - none) * c;
                power.holm_any += c > 0 ? reached[c] * (1 - none) : 0;
            }
        }
        reached = std::move(next);
    }
    for (std::uint32_t c = 1; c <= all; ++c) {
        rejected += reached[c] * c;
        power.holm_any += reached[c];
    }
    power.holm_share = rejected / all;
    return power;
}

}  // namespace merl::scan
