#include "app/pipeline/tune.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "app/pipeline/refine.h"
#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/distance/distances.h"
#include "engine/distance/parts/summary.h"

namespace merl::pipeline {
namespace {

using engine::Metric;

/// Where in the ranges of the fitted parameters it is looked whether windows depend on them.
constexpr std::array kProbes = {0.29, 0.71};

/// Which of a metric's parameters are fitted, by their place.
std::vector<std::size_t> places_of(const Metric& metric,
                                   std::span<const scan::TuneParameter> parameters) {
    std::vector<std::size_t> places;
    for (const auto& parameter : parameters) {
        const auto found = std::ranges::find(metric.header.parameters, parameter.name,
                                             &engine::MetricParameter::name);
        places.push_back(static_cast<std::size_t>(found - metric.header.parameters.begin()));
    }
    return places;
}

/// The metric with these values of the fitted parameters.
Metric with_values(const Metric& metric, std::span<const std::size_t> places,
                   std::span<const double> values) {
    auto all = metric.parameters;
    for (std::size_t i = 0; i < places.size(); ++i) {
        all[places[i]] = values[i];
    }
    return engine::with_parameters(metric, all);
}

std::vector<double> start_of(std::span<const scan::TuneParameter> parameters) {
    std::vector<double> values;
    for (const auto& parameter : parameters) {
        values.push_back(parameter.start);
    }
    return values;
}

/// Calls `compute`, and names the values under which something cannot be used.
template <typename Compute>
auto named(const Metric& metric, const Compute& compute) {
    try {
        return compute();
    } catch (const InputError& error) {
        throw InputError(fmt::format("{} (while fitting, with {})", error.what(), metric.name));
    }
}

/// Where distances come from while parameters are looked for.
class SearchDistances {
  public:
    SearchDistances(engine::Engines& engines, const engine::Database& database,
                    const Metric& metric, std::span<const scan::TuneParameter> parameters,
                    std::uint64_t memory_bytes, const Control& control)
        : engines_(engines),
          database_(database),
          metric_(metric),
          places_(places_of(metric, parameters)),
          memory_bytes_(memory_bytes),
          control_(control) {
        std::vector<Metric> metrics = {metric};
        if (metric.is_summary()) {
            for (const double probe : kProbes) {
                std::vector<double> values;
                for (const auto& parameter : parameters) {
                    values.push_back(parameter.low + probe * (parameter.high - parameter.low));
                }
                metrics.push_back(with_values(metric, places_, values));
            }
        }
        auto result = compute(metrics, [&](double share) { control.update("distances", share); });
        provenance_ = provenance_of(database, result);
        seconds_ = result.seconds.without_opening();
        const auto& means = result.distances[0].means;
        from_means_ =
            metric.is_summary() &&
            std::ranges::all_of(result.distances, [&](const auto& d) { return d.means == means; });
        means_ = std::move(result.distances[0].means);
        if (from_means_ && !metric.has_twin()) {
            const Metric* const one[] = {&metric};
            std::vector<std::string> warnings;  // those that distances come with in the end
            engine_ = engines.share(one, warnings).front().engine;
            Stopwatch watch;
            at(start_of(parameters));
            seconds_ = watch.lap();
        }
    }

    /// Whether they come from means that were read once.
    bool from_means() const { return from_means_; }

    /// Whether they come at once, to any thread, and not from a device or the database.
    bool is_quick() const { return from_means_ && metric_.has_twin(); }

    const DatabaseProvenance& provenance() const { return provenance_; }

    /// Of one evaluation, if they are not quick.
    double seconds() const { return seconds_; }

    Metric metric_with(std::span<const double> values) const {
        return with_values(metric_, places_, values);
    }

    std::vector<double> at(std::span<const double> values) const {
        const std::array metrics = {metric_with(values)};
        return named(metrics[0], [&] {
            const std::function<void()> meanwhile = [&] { control_.update("fitting", share_); };
            if (from_means_) {
                const auto features = is_quick() ? engine::twin_features(metrics[0])
                                                 : engine_->features(metrics[0], meanwhile);
                return engine::summary_values(metrics[0], means_, features, database_.materials());
            }
            auto result = compute(metrics, [&](double) { meanwhile(); });
            return std::move(result.distances[0].values);
        });
    }

    /// What is done of the search: while a computation is at work it is shown on.
    void done(double share) { share_ = share; }

  private:
    engine::DistanceResult compute(std::span<const Metric> metrics,
                                   const std::function<void(double)>& progress) const {
        std::vector<const Metric*> pointers;
        for (const auto& metric : metrics) {
            pointers.push_back(&metric);
        }
        return engine::compute_distances(engines_, database_, pointers,
                                         {.memory_bytes = memory_bytes_, .progress = progress});
    }

    engine::Engines& engines_;
    const engine::Database& database_;
    const Metric& metric_;
    std::vector<std::size_t> places_;
    std::uint64_t memory_bytes_;
    const Control& control_;
    bool from_means_ = false;
    engine::Engine* engine_ = nullptr;  // where a device evaluates the features
    double seconds_ = 0;
    DatabaseProvenance provenance_;
    double share_ = 0;
    std::vector<engine::WindowMean> means_;
};

/// What was computed from means must be what all commands compute.
void require_same(const Metric& metric, std::span<const double> quick,
                  const scan::MetricColumn& whole) {
    for (std::size_t p = 0; p < quick.size(); ++p) {
        if (std::abs(quick[p] - whole.values[p]) > 2 * whole.bounds[p]) {
            throw InputError(
                fmt::format("{}: a window of it depends on a fitted parameter, though not where "
                            "that was looked "
                            "for (distance {} is {}, from means {}); fit the others only",
                            metric.name, p, whole.values[p], quick[p]));
        }
    }
}

}  // namespace

std::vector<scan::TuneParameter> tune_parameters(const Metric& metric,
                                                 std::span<const std::string> names) {
    const auto& declared = metric.header.parameters;
    if (declared.empty()) {
        throw Error(
            Fault::usage,
            fmt::format("the metric {} has no parameters: there is nothing to fit", metric.name));
    }
    std::vector<std::string> all(declared.size());
    std::ranges::transform(declared, all.begin(), &engine::MetricParameter::name);
    std::vector<scan::TuneParameter> result;
    for (const auto& name : names.empty() ? std::span<const std::string>(all) : names) {
        const auto found = std::ranges::find(declared, name, &engine::MetricParameter::name);
        if (found == declared.end()) {
            throw Error(Fault::usage,
                        fmt::format("the metric {} has no parameter \"{}\"; its parameters are: {}",
                                    metric.name, name, fmt::join(all, ", ")));
        }
        if (std::ranges::find(result, name, &scan::TuneParameter::name) != result.end()) {
            throw Error(Fault::usage,
                        fmt::format("the parameter {} is to be fitted twice; expected different "
                                    "names",
                                    name));
        }
        if (!(found->low < found->high)) {
            throw Error(Fault::usage,
                        fmt::format("the parameter {} of {} can only be {}: there is nothing to "
                                    "fit",
                                    name, metric.name, found->low));
        }
        const auto place = static_cast<std::size_t>(found - declared.begin());
        result.push_back({name, metric.parameters[place], found->low, found->high});
    }
    return result;
}

TuneResult tune(engine::Engines& engines, const engine::Database& database, const Metric& metric,
                std::span<const scan::TuneParameter> parameters,
                const scan::JudgementFile& judgements, const TuneOptions& options,
                const Control& control) {
    TuneResult result;
    engine::require_usable(database);
    result.judgements = scan::resolve_judgements(judgements, database.materials());
    Stopwatch watch;
    SearchDistances distances(engines, database, metric, parameters, options.memory_bytes, control);
    result.reading_seconds = watch.lap();
    result.from_means = distances.from_means();
    const scan::TuneOptions search = {
        .fit = {.evaluations = options.evaluations.value_or(
                    distances.is_quick() ? quick_evaluations : slow_evaluations),
                .seed = options.seed},
        .at_once = distances.is_quick()};
    if (options.begin) {
        options.begin({.database = distances.provenance(),
                       .is_quick = distances.is_quick(),
                       .evaluations = scan::most_evaluations(result.judgements, search.fit),
                       .seconds_per_evaluation = distances.seconds()});
    }
    result.tuning = scan::tune(
        result.judgements, parameters,
        [&](std::span<const double> values) { return distances.at(values); }, search,
        [&](double share) {
            distances.done(share);
            control.update("fitting", share);
        });
    result.fit_seconds = watch.lap();

    result.metric = distances.metric_with(result.tuning.fit.values);
    const Metric* const both[] = {&metric, &result.metric};
    result.distances =
        compute_pair_distances(engines, database, both, options.memory_bytes, control);
    auto& table = result.distances.table;
    if (result.from_means) {
        require_same(result.metric, distances.at(result.tuning.fit.values), table.metrics[1]);
    }
    watch.lap();
    result.refined = refine_judged(table, result.judgements, database, both, options.memory_bytes,
                                   control.stage("refining"), &engines);
    scan::score_tuning(result.tuning, result.judgements, table.metrics[0].values,
                       table.metrics[1].values);
    result.refine_seconds = watch.lap();
    result.doubts = scan::doubts(result.tuning);
    return result;
}

}  // namespace merl::pipeline
