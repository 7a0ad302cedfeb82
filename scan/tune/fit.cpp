#include "scan/tune/fit.h"

#include <fmt/format.h>
#include <nlopt.h>

#include <algorithm>
#include <boost/random/uniform_real_distribution.hpp>
#include <cmath>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <random>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "engine/base/number.h"
#include "scan/score/score.h"
#include "scan/statistics/choice_model.h"

namespace merl::scan {
namespace {

/// The search is over when a step gains less than this share of the log-likelihood, of which a
/// large study has 50,000. With ten times as much it ends on the way where a parameter is far off.
constexpr double likelihood_tolerance = 1e-7;

/// Of the width of the ranges: the first steps, and how far other starts are from the first.
constexpr double first_step = 0.1;
constexpr double farthest_start = 0.25;

/// Where a range is over so many powers of ten, or from 0 on, equal steps would see only its end.
constexpr double wide_range = 100;

/// A parameter as the search sees it: from 0 to 1 over its range.
class Coordinate {
    enum class Scale { linear, square_root, logarithm };

  public:
    explicit Coordinate(const TuneParameter& parameter)
        : low_(parameter.low),
          high_(parameter.high),
          scale_(low_ == 0                                ? Scale::square_root
                 : low_ > 0 && high_ / low_ >= wide_range ? Scale::logarithm
                                                          : Scale::linear) {}

    double from(double value) const {
        const double share = (value - low_) / (high_ - low_);
        switch (scale_) {
            case Scale::square_root:
                return std::sqrt(share);
            case Scale::logarithm:
                return std::clamp(std::log(value / low_) / std::log(high_ / low_), 0.0, 1.0);
            case Scale::linear:
                break;
        }
        return share;
    }

    double value(double at) const {
        double value = low_ + at * (high_ - low_);
        if (scale_ == Scale::square_root) {
            value = at * at * high_;
        } else if (scale_ == Scale::logarithm) {
            value = low_ * std::pow(high_ / low_, at);
        }
        return std::clamp(value, low_, high_);
    }

    /// The value to four digits, in the range.
    double rounded(double value) const {
        return std::clamp(*parse_number<double>(fmt::format("{:.4g}", value)), low_, high_);
    }

  private:
    double low_;
    double high_;
    Scale scale_;
};

/// A fit, and how high it is for the search.
struct Place {
    Fit fit;
    double height;
};

/// The likelihood that a search climbs, and the highest place that it has seen.
class Objective {
  public:
    Objective(std::span<const Judgement> judgements, const DistancesAt& distances_at,
              const std::function<void()>& evaluated)
        : judgements_(judgements), distances_at_(distances_at), evaluated_(evaluated) {}

    Place at(std::span<const double> values) {
        const auto choices = choices_of(judgements_, distances_at_(values));
        const auto [slope, log_likelihood] = fit_choice_model(choices);
        double votes = 0;
        for (const auto& choice : choices) {
            votes += choice.with + choice.against;
        }
        const double chance = votes * std::log(0.5);
        const bool opposed = slope < 0;
        Place place = {{{values.begin(), values.end()}, slope, ++evaluations_},
                       opposed ? 2 * chance - log_likelihood : log_likelihood};
        if (!highest_ || place.height > highest_->height) {
            highest_ = place;
        }
        if (evaluated_) {
            evaluated_();
        }
        return place;
    }

    const Place& highest() const { return *highest_; }
    std::uint32_t evaluations() const { return evaluations_; }

  private:
    std::span<const Judgement> judgements_;
    const DistancesAt& distances_at_;
    const std::function<void()>& evaluated_;
    std::uint32_t evaluations_ = 0;
    std::optional<Place> highest_;
};

/// One search, by a library in C, through which no exception may pass.
struct Search {
    Objective& objective;
    std::span<const Coordinate> coordinates;
    nlopt_opt handle = nullptr;
    std::exception_ptr failure = nullptr;
};

double height(unsigned count, const double* at, double* /*gradient*/, void* data) {
    auto& search = *static_cast<Search*>(data);
    try {
        std::vector<double> values(count);
        for (std::size_t i = 0; i < count; ++i) {
            values[i] = search.coordinates[i].value(at[i]);
        }
        return search.objective.at(values).height;
    } catch (...) {
        search.failure = std::current_exception();
        nlopt_force_stop(search.handle);
        return -std::numeric_limits<double>::infinity();
    }
}

void climb(Search& search, std::vector<double> start, std::uint32_t evaluations) {
    const std::unique_ptr<std::remove_pointer_t<nlopt_opt>, decltype(&nlopt_destroy)> opt(
        nlopt_create(NLOPT_LN_SBPLX, static_cast<unsigned>(start.size())), nlopt_destroy);
    search.handle = opt.get();
    double reached = 0;
    const bool is_set = opt != nullptr && nlopt_set_max_objective(opt.get(), height, &search) > 0 &&
                        nlopt_set_lower_bounds1(opt.get(), 0) > 0 &&
                        nlopt_set_upper_bounds1(opt.get(), 1) > 0 &&
                        nlopt_set_initial_step1(opt.get(), first_step) > 0 &&
                        nlopt_set_ftol_rel(opt.get(), likelihood_tolerance) > 0 &&
                        nlopt_set_maxeval(opt.get(), static_cast<int>(evaluations)) > 0;
    const auto ended = is_set ? nlopt_optimize(opt.get(), start.data(), &reached) : NLOPT_FAILURE;
    if (search.failure) {
        std::rethrow_exception(search.failure);
    }
    if (ended == NLOPT_OUT_OF_MEMORY || opt == nullptr) {
        throw std::bad_alloc();
    }
    if (ended < 0 && ended != NLOPT_ROUNDOFF_LIMITED) {  // that is a maximum
        throw std::logic_error(fmt::format("NLopt: {}", nlopt_result_to_string(ended)));
    }
}

}  // namespace

Fit fit_parameters(std::span<const Judgement> judgements, std::span<const TuneParameter> parameters,
                   const DistancesAt& distances_at, const FitOptions& options,
                   const std::function<void()>& evaluated) {
    const std::vector<Coordinate> coordinates(parameters.begin(), parameters.end());
    std::vector<double> values;
    std::vector<double> first;
    for (std::size_t i = 0; i < parameters.size(); ++i) {
        values.push_back(parameters[i].start);
        first.push_back(coordinates[i].from(parameters[i].start));
    }
    Objective objective(judgements, distances_at, evaluated);
    const Place start = objective.at(values);  // itself, not what its coordinates stand for
    std::mt19937_64 random(options.seed);
    // The standard library's distribution may differ from one library to the next.
    boost::random::uniform_real_distribution<double> moved(-farthest_start, farthest_start);
    for (std::uint32_t n = 0; n < fit_starts; ++n) {
        auto from = first;
        for (double& at : from) {
            at = n == 0 ? at : std::clamp(at + moved(random), 0.0, 1.0);
        }
        // One is left for what is rounded at the end.
        if (objective.evaluations() + 1 < options.evaluations) {
            Search search{objective, coordinates};
            climb(search, std::move(from), options.evaluations - objective.evaluations() - 1);
        }
    }
    if (objective.highest().fit.values == values) {
        return {values, start.fit.slope, objective.evaluations()};
    }
    values = objective.highest().fit.values;
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = coordinates[i].rounded(values[i]);
    }
    const Place rounded = objective.at(values);
    Fit fit = rounded.height > start.height ? rounded.fit : start.fit;
    fit.evaluations = objective.evaluations();
    return fit;
}

}  // namespace merl::scan
