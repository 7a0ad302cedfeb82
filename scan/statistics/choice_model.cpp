#include "scan/statistics/choice_model.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace merl::scan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

/// First derivative of the log-likelihood and the negative of the second, which is never negative.
struct Derivatives {
    double gradient = 0;
    double curvature = 0;
};

Derivatives derivatives(std::span<const WeightedChoices> data, double slope) {
    Derivatives sum;
    for (const auto& [choices, times] : data) {
        Derivatives part;
        for (const auto& [ratio, with, against] : choices) {
            // exp of what is not positive cannot overflow; p is the probability of the likelier.
            const double e = std::exp(-std::abs(slope * ratio));
            const double p = 1 / (1 + e);
            const double q = e / (1 + e);
            const double agree = slope >= 0 ? p : q;
            const double oppose = slope >= 0 ? q : p;
            part.gradient += ratio * (with * oppose - against * agree);
            part.curvature += ratio * ratio * (with + against) * p * q;
        }
        sum.gradient += times * part.gradient;
        sum.curvature += times * part.curvature;
    }
    return sum;
}

/// ln of the probability 1 / (1 + exp(-t)).
double log_probability(double t) {
    return std::min(t, 0.0) - std::log1p(std::exp(-std::abs(t)));
}

/// Where the derivative is 0, by Newton's method from a guess. Requires that there is such a place.
/// The curvature is greatest at 0 and falls to both sides, so from 0 on the steps approach the root
/// without ever passing it; a guess beyond the root first steps back, at worst past 0.
double find_root(std::span<const WeightedChoices> data, double slope) {
    for (int step = 0; step < 100; ++step) {
        const auto [gradient, curvature] = derivatives(data, slope);
        if (gradient == 0) {
            break;
        }
        double next = slope + gradient / curvature;
        if (slope != 0 && !(std::isfinite(next) && next * slope > 0)) {
            next = 0;
        }
        const double moved = std::abs(next - slope);
        slope = next;
        if (moved <= 1e-13 * std::abs(slope)) {
            break;
        }
    }
    return slope;
}

}  // namespace

double log_likelihood(std::span<const WeightedChoices> data, double slope) {
    double sum = 0;
    for (const auto& [choices, times] : data) {
        double part = 0;
        for (const auto& [ratio, with, against] : choices) {
            const double t = ratio == 0 ? 0 : slope * ratio;
            part += with == 0 ? 0 : with * log_probability(t);
            part += against == 0 ? 0 : against * log_probability(-t);
        }
        sum += times == 0 ? 0 : times * part;
    }
    return sum;
}

ChoiceModel fit_choice_model(std::span<const WeightedChoices> data, double start) {
    double with = 0;
    double against = 0;
    for (const auto& [choices, times] : data) {
        for (const auto& choice : choices) {
            with += choice.log_ratio > 0 ? times * choice.with : 0;
            against += choice.log_ratio > 0 ? times * choice.against : 0;
        }
    }
    double slope = 0;
    if (with > 0 && against > 0) {
        slope = find_root(data, std::isfinite(start) ? start : 0);
    } else if (with > 0) {
        slope = infinity;
    } else if (against > 0) {
        slope = -infinity;
    }
    return {slope, log_likelihood(data, slope)};
}

}  // namespace merl::scan
