#include "scan/tune/tune.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numeric>
#include <optional>
#include <utility>

#include "scan/statistics/choice_model.h"

namespace merl::scan {
namespace {

/// Of so many evaluations of distances is one fit, and the test of what came of it, at most.
std::uint64_t evaluations_of_fold(const FitOptions& options) {
    return std::uint64_t{options.evaluations} + 1;
}

/// The share that is done of several fits, each of which takes its part of the time.
class Done {
  public:
    Done(double total, const std::function<void(double share)>& progress)
        : total_(total), progress_(progress) {}

    void add(double part) {
        const std::scoped_lock lock(mutex_);
        done_ += part;
        if (progress_) {
            progress_(std::min(done_ / total_, 1.0));
        }
    }

  private:
    double total_;
    const std::function<void(double share)>& progress_;
    std::mutex mutex_;
    double done_ = 0;
};

/// The judgements that a fold tests or trains, by their place in the list.
template <typename Takes>
std::vector<std::size_t> taken(const Judgements& judgements, const Takes& takes) {
    std::vector<std::size_t> places;
    for (std::size_t k = 0; k < judgements.list.size(); ++k) {
        if (takes(materials_of(judgements.list[k], judgements.materials))) {
            places.push_back(k);
        }
    }
    return places;
}

std::vector<Judgement> at(const Judgements& judgements, std::span<const std::size_t> places) {
    std::vector<Judgement> list;
    list.reserve(places.size());
    for (const auto k : places) {
        list.push_back(judgements.list[k]);
    }
    return list;
}

/// The sums of predictions of one judgement.
struct Tests {
    std::uint32_t times = 0;
    Prediction start = {};
    Prediction fitted = {};
};

void add(Prediction& sum, const Prediction& more) {
    sum.prefers_left += more.prefers_left;
    sum.log_likelihood += more.log_likelihood;
}

Prediction mean(const Prediction& sum, std::uint32_t times) {
    return {sum.prefers_left / times, sum.log_likelihood / times};
}

/// What a fold says of the judgements that it tests.
struct FoldTest {
    FoldFit of;
    std::vector<std::size_t> places;
    std::vector<Prediction> start;
    std::vector<Prediction> fitted;
};

/// What all fits work with.
struct Work {
    const Judgements& judgements;
    std::span<const TuneParameter> parameters;
    const DistancesAt& distances_at;
    const TuneOptions& options;
    std::vector<double> start_distances;
    Done& done;

    /// The part of the time that fits to so many judgements take. Where distances are quick what
    /// takes time is the likelihood.
    double part(std::size_t trained) const {
        return options.at_once ? static_cast<double>(trained) : 1;
    }

    Fit fit(std::span<const Judgement> training) const {
        const double all = part(training.size());
        const double one = all / static_cast<double>(evaluations_of_fold(options.fit));
        double left = all;
        auto result = fit_parameters(training, parameters, distances_at, options.fit, [&] {
            left -= one;
            done.add(one);
        });
        done.add(left);
        return result;
    }
};

FoldTest test(const Work& work, Fold fold) {
    const auto& judgements = work.judgements;
    const auto training =
        at(judgements, taken(judgements, [&](const auto& m) { return fold.trains(m); }));
    auto places = taken(judgements, [&](const auto& m) { return fold.tests(m); });
    const auto tested = at(judgements, places);
    auto fit = work.fit(training);
    const auto start = fit_choice_model(choices_of(training, work.start_distances));
    return {.of = {std::move(fold), training.size(), tested.size(), fit},
            .places = std::move(places),
            .start = predictions(tested, work.start_distances, start.slope),
            .fitted = predictions(tested, work.distances_at(fit.values), fit.slope)};
}

/// Adds up what all folds say of each judgement, in the order of the folds.
CrossValidation cross_validation(FoldKind kind, const Judgements& judgements,
                                 std::span<const FoldTest> tests) {
    CrossValidation result{kind, {}, {}};
    std::vector<Tests> sums(judgements.list.size());
    for (const auto& test : tests) {
        result.folds.push_back(test.of);
        for (std::size_t i = 0; i < test.places.size(); ++i) {
            auto& sum = sums[test.places[i]];
            ++sum.times;
            add(sum.start, test.start[i]);
            add(sum.fitted, test.fitted[i]);
        }
    }
    Judgements tested = judgements;
    tested.list.clear();
    std::vector<Prediction> start;
    std::vector<Prediction> fitted;
    for (std::size_t k = 0; k < sums.size(); ++k) {
        if (sums[k].times > 0) {
            tested.list.push_back(judgements.list[k]);
            start.push_back(mean(sums[k].start, sums[k].times));
            fitted.push_back(mean(sums[k].fitted, sums[k].times));
        }
    }
    if (!tests.empty()) {
        result.scores = score_predictions(tested, start, fitted);
    }
    return result;
}

std::uint64_t evaluations(const CrossValidation& validation) {
    return std::accumulate(
        validation.folds.begin(), validation.folds.end(), std::uint64_t{0},
        [](std::uint64_t sum, const FoldFit& fold) { return sum + fold.fit.evaluations + 1; });
}

}  // namespace

std::uint64_t most_evaluations(const Judgements& judgements, const FitOptions& options) {
    const auto folds = make_folds(FoldKind::references, judgements, options.seed).size() +
                       make_folds(FoldKind::materials, judgements, options.seed).size();
    return (1 + folds) * evaluations_of_fold(options) + 1;
}

Tuning tune(const Judgements& judgements, std::span<const TuneParameter> parameters,
            const DistancesAt& distances_at, const TuneOptions& options,
            const std::function<void(double share)>& progress) {
    const auto seed = options.fit.seed;
    auto folds = make_folds(FoldKind::references, judgements, seed);
    const std::size_t by_reference = folds.size();
    for (auto& fold : make_folds(FoldKind::materials, judgements, seed)) {
        folds.push_back(std::move(fold));
    }
    double total = options.at_once ? static_cast<double>(judgements.list.size()) : 1;
    for (const auto& fold : folds) {
        const auto trains = [&](const auto& materials) { return fold.trains(materials); };
        total += options.at_once ? static_cast<double>(taken(judgements, trains).size()) : 1;
    }
    Done done(total, progress);
    std::vector<double> start;
    for (const auto& parameter : parameters) {
        start.push_back(parameter.start);
    }
    const Work work = {judgements, parameters, distances_at, options, distances_at(start), done};

    std::optional<Fit> fit;
    std::vector<FoldTest> tests(folds.size());
    const auto one = [&](std::size_t i) {
        if (i == 0) {
            fit = work.fit(judgements.list);
        } else {
            tests[i - 1] = test(work, folds[i - 1]);
        }
    };
    if (options.at_once) {
        tbb::parallel_for(std::size_t{0}, folds.size() + 1, one);
    } else {
        for (std::size_t i = 0; i <= folds.size(); ++i) {
            one(i);
        }
    }
    Tuning result = {.parameters = {parameters.begin(), parameters.end()},
                     .start_slope = 0,
                     .fit = *fit,
                     .scores = {},
                     .by_reference = cross_validation(FoldKind::references, judgements,
                                                      std::span(tests).first(by_reference)),
                     .by_materials = cross_validation(FoldKind::materials, judgements,
                                                      std::span(tests).subspan(by_reference)),
                     .evaluations = 0,
                     .fits = 1 + folds.size(),
                     .cut_short = 0};
    score_tuning(result, judgements, work.start_distances, distances_at(fit->values));
    result.evaluations =
        2 + fit->evaluations + evaluations(result.by_reference) + evaluations(result.by_materials);
    const auto is_cut_short = [&](const Fit& of_some) {
        return of_some.evaluations >= options.fit.evaluations;
    };
    result.cut_short = is_cut_short(*fit) ? 1 : 0;
    for (const auto* validation : {&result.by_reference, &result.by_materials}) {
        result.cut_short += static_cast<std::uint64_t>(
            std::ranges::count_if(validation->folds, is_cut_short, &FoldFit::fit));
    }
    return result;
}

void score_tuning(Tuning& tuning, const Judgements& judgements,
                  std::span<const double> start_distances,
                  std::span<const double> fitted_distances) {
    const auto start = fit_choice_model(choices_of(judgements.list, start_distances));
    const auto fitted = fit_choice_model(choices_of(judgements.list, fitted_distances));
    tuning.start_slope = start.slope;
    tuning.fit.slope = fitted.slope;
    tuning.scores =
        score_predictions(judgements, predictions(judgements.list, start_distances, start.slope),
                          predictions(judgements.list, fitted_distances, fitted.slope));
}

std::vector<std::string> doubts(const Tuning& tuning) {
    std::vector<std::string> found;
    const auto fitted = tuning.parameters.size();
    const auto untied = tuning.scores.untied;
    if (untied < fewest_judgements_per_parameter * fitted) {
        found.push_back(fmt::format(
            "{} configurations with a majority are too few for {} fitted parameters: expected {} "
            "or more for each",
            untied, fitted, fewest_judgements_per_parameter));
    }
    const auto& unseen = tuning.by_materials;
    if (unseen.folds.empty()) {
        found.emplace_back(
            "there are too few materials to leave some out of fitting: nothing says what the "
            "fitted parameters are worth on others");
        return found;
    }
    const double gained = tuning.scores.gain.log_likelihood.value;
    const double kept = unseen.scores.gain.log_likelihood.value;
    const double likelihood = unseen.scores.second.log_likelihood.value;
    if (likelihood <= std::log(0.5)) {
        found.push_back(fmt::format(
            "on materials that were left out of fitting the fitted parameters predict no better "
            "than chance ({:.3f} per vote): the judgements are too few for {} parameters, or the "
            "metric cannot say what people say",
            likelihood, fitted));
    } else if (kept <= 0) {
        found.push_back(fmt::format(
            "on materials that were left out of fitting the fitted parameters predict no better "
            "than those at the start ({:+.3f} in log-likelihood per vote): the judgements are too "
            "few for {} parameters",
            kept, fitted));
    } else if (gained > 0 && kept < gained / 2) {
        found.push_back(fmt::format(
            "of what fitting gains on the judgements themselves ({:+.3f} in log-likelihood per "
            "vote) less than half is left on materials that were left out ({:+.3f}): the "
            "judgements are few for {} parameters",
            gained, kept, fitted));
    } else if (gained > 0 && unseen.scores.gain.log_likelihood.too_few.empty() &&
               !clear_of_zero(unseen.scores.gain.log_likelihood)) {
        const auto& [low, high] = unseen.scores.gain.log_likelihood.interval;
        found.push_back(fmt::format(
            "on materials that were left out of fitting what fitting gains is not clear of 0: "
            "{:+.3f} [{:+.3f}, {:+.3f}] in log-likelihood per vote",
            kept, low, high));
    }
    return found;
}

}  // namespace merl::scan
