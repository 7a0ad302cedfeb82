#include "scan/statistics/choice_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace merl::scan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

Derivatives derivatives(std::span<const Choice> choices, double slope) {
    Derivatives sum;
    for (const auto& choice : choices) {
        const auto [gradient, curvature] = derivatives(choice, slope);
        sum.gradient += gradient;
        sum.curvature += curvature;
    }
    return sum;
}

/// ln of the probability 1 / (1 + exp(-t)).
double log_probability(double t) {
    return std::min(t, 0.0) - std::log1p(std::exp(-std::abs(t)));
}

/// Where the derivative is 0, by Newton's method from 0. Requires that there is such a place. The
/// curvature is greatest at 0 and falls to both sides, so the steps approach the root without ever
/// passing it.
double find_root(std::span<const Choice> choices) {
    double slope = 0;
    for (int step = 0; step < 100; ++step) {
        const auto [gradient, curvature] = derivatives(choices, slope);
        if (gradient == 0) {
            break;
        }
        const double next = slope + gradient / curvature;
        const double moved = std::abs(next - slope);
        slope = next;
        if (moved <= 1e-13 * std::abs(slope)) {
            break;
        }
    }
    return slope;
}

}  // namespace

Derivatives derivatives(const Choice& choice, double slope) {
    const auto& [ratio, with, against] = choice;
    // exp of what is not positive cannot overflow; p is the probability of the likelier.
    const double e = std::exp(-std::abs(slope * ratio));
    const double p = 1 / (1 + e);
    const double q = e / (1 + e);
    const double agree = slope >= 0 ? p : q;
    const double oppose = slope >= 0 ? q : p;
    return {ratio * (with * oppose - against * agree), ratio * ratio * (with + against) * p * q};
}

double log_likelihood(const Choice& choice, double slope) {
    const auto& [ratio, with, against] = choice;
    const double t = ratio == 0 ? 0 : slope * ratio;
    return (with == 0 ? 0 : with * log_probability(t)) +
           (against == 0 ? 0 : against * log_probability(-t));
}

ChoiceModel fit_choice_model(std::span<const Choice> choices) {
    double with = 0;
    double against = 0;
    for (const auto& choice : choices) {
        with += choice.log_ratio > 0 ? choice.with : 0;
        against += choice.log_ratio > 0 ? choice.against : 0;
    }
    ChoiceModel model{0, 0};
    if (with > 0 && against > 0) {
        model.slope = find_root(choices);
    } else if (with > 0) {
        model.slope = infinity;
    } else if (against > 0) {
        model.slope = -infinity;
    }
    for (const auto& choice : choices) {
        model.log_likelihood += log_likelihood(choice, model.slope);
    }
    return model;
}

}  // namespace merl::scan
