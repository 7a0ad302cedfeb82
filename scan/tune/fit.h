#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scan/score/judgements.h"

namespace merl::scan {

/// A number of a metric that is fitted to judgements.
struct TuneParameter {
    std::string name;
    double start;  ///< where the search begins
    double low;    ///< the range, both ends allowed; low < high
    double high;
};

/// The distances of all pairs of materials, in pair order, finite and 0 or more, under values of
/// the parameters.
using DistancesAt = std::function<std::vector<double>(std::span<const double> values)>;

/// How long a search may be, and which.
struct FitOptions {
    std::uint32_t evaluations = 2000;  ///< of distances, at most, in one fit
    std::uint64_t seed = 1;            ///< of the starts after the first
};

/// So many searches are one fit, as far as there are evaluations for them: from the start that is
/// given, and from others about it.
inline constexpr std::uint32_t fit_starts = 3;

/// Values of greatest likelihood.
struct Fit {
    std::vector<double> values;  ///< of the parameters, in their ranges
    double slope;                ///< of the choice model under them
    std::uint32_t evaluations;   ///< how many it took
};

/// Fits parameters, and with them the slope, to judgements: maximises the likelihood of the choice
/// model by the Sbplx method (NLopt), which needs no derivatives, within the ranges. Values that
/// people oppose (a slope below 0) are worse than chance by as much as their opposite is better, so
/// that the search is led away from them. The values are rounded to four digits, of which the
/// judgements rarely know more. `evaluated` is called after every evaluation. What it and
/// `distances_at` throw comes out. Requires a parameter, a judgement and `evaluations` > 0.
Fit fit_parameters(std::span<const Judgement> judgements, std::span<const TuneParameter> parameters,
                   const DistancesAt& distances_at, const FitOptions& options,
                   const std::function<void()>& evaluated = {});

}  // namespace merl::scan
