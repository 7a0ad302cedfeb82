#pragma once

#include <cstdint>
#include <span>

namespace merl::scan {

/// What one configuration says about a metric.
struct Choice {
    double log_ratio;  ///< |ln(D_left / D_right)|, finite
    double with;       ///< votes for the pair with the smaller distance
    double against;    ///< votes for the other; at log_ratio 0 it does not matter which is which
};

/// A logistic choice model with one parameter, the slope b: people take the pair with the smaller
/// distance with probability 1 / (1 + exp(-b log_ratio)). b > 0: they follow the metric; 0: they
/// do not heed it. The scale of a metric does not matter, and a power of it divides the slope.
struct ChoiceModel {
    double slope;
    double log_likelihood;  ///< natural logarithm, all votes together
};

/// The slope of greatest likelihood, by Newton's method. Where every vote at
/// log_ratio > 0 is with the metric the slope is infinity (and -infinity where all are against it),
/// with the likelihood's limit; where there is no such vote the slope is 0.
ChoiceModel fit_choice_model(std::span<const Choice> choices);

/// The log-likelihood of a choice under a slope, which may be infinite.
double log_likelihood(const Choice& choice, double slope);

/// Derivatives of a choice's log-likelihood by the slope, which is finite.
struct Derivatives {
    double gradient = 0;
    double curvature = 0;  ///< the negative of the second derivative, which is never negative
};

Derivatives derivatives(const Choice& choice, double slope);

}  // namespace merl::scan
