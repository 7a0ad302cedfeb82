#include "app/pipeline/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "scan/pairs/bounded_count.h"
#include "scan/select/disagreements.h"
#include "scan/select/selection.h"
#include "scan/select/undecided.h"

namespace merl::pipeline {
namespace {

void require_listable(std::uint64_t disagreements) {
    if (disagreements > scan::max_listed) {
        throw TooManyDisagreements(fmt::format("{} disagreements are more than can be listed ({})",
                                               disagreements, scan::max_listed));
    }
}

std::vector<scan::Configuration> list_disagreements(const scan::Distances& distances,
                                                    std::uint64_t counted,
                                                    std::optional<std::uint64_t> wanted,
                                                    const Control& control) {
    const auto listed = std::min(wanted.value_or(counted), counted);
    require_listable(listed);
    auto list = scan::strongest_disagreements(distances, listed, control.stage("listing"));
    if (list.size() != listed) {
        throw std::logic_error(fmt::format("{} disagreements were counted and {} of {} listed",
                                           counted, list.size(), listed));
    }
    return list;
}

/// Whether a metric has final distances that may be closer than their bounds.
bool has_final_bounds(const scan::Distances& d) {
    return (d.first_is_final && !d.first_bounds.empty()) ||
           (d.second_is_final && !d.second_bounds.empty());
}

}  // namespace

ScanResult scan_distances(scan::DistanceTable table, const engine::Database* database,
                          std::span<const engine::Metric* const> metrics,
                          const ScanOptions& options, const Control& control) {
    if (table.metrics.size() < 2) {
        throw std::invalid_argument(
            fmt::format("a table of {} metrics: a scan takes the first two", table.metrics.size()));
    }
    if (database != nullptr) {
        require_source(table, *database, metrics);
    }
    ScanResult result;
    Stopwatch watch;
    auto& distances = result.distances;
    distances = std::exchange(table, {}).distances(0, 1);
    const auto both = metrics.first(std::min<std::size_t>(metrics.size(), 2));
    for (const auto* metric : both) {
        if (!metric->has_bound()) {
            result.unbounded.push_back(metric->name);
        }
    }
    const auto counting = control.stage("counting");
    result.bounded = scan::bound_disagreements(distances, counting);
    result.undecided = result.bounded.undecided;
    if (!options.disagreements) {
        require_listable(result.bounded.least);  // rather than after all the work
    }
    // The strongest disagreement is shown, so at least one is selected.
    const auto select = std::max(1U, options.select);
    const auto per_material = std::max(1U, options.per_material);
    const auto decided =
        options.fast ? scan::Decided::selection : scan::Decided::count_and_selection;
    // Without a bound the selection alone rests on all distances as well.
    const bool may_be_exact = std::ranges::all_of(
        both, [&](const engine::Metric* metric) { return can_be_exact(*metric, options.engines); });
    const bool refinable =
        database != nullptr && may_be_exact && (!options.fast || result.unbounded.empty());
    if (refinable) {
        result.refined = refine(distances, *database, {metrics[0], metrics[1]}, select,
                                per_material, options.memory_bytes,
                                {.deciding = control.stage("deciding"),
                                 .wanted =
                                     [&](std::uint64_t wanted) {
                                         if (options.before_refining) {
                                             options.before_refining(
                                                 wanted, 2 * std::uint64_t{distances.pairs()});
                                         }
                                     },
                                 .refining = control.stage("refining")},
                                decided, options.engines);
    }
    const bool all_decided = refinable && !options.fast && !has_final_bounds(distances);
    if (!all_decided && result.refined.first + result.refined.second > 0) {
        result.bounded = scan::bound_disagreements(distances, counting);
    }
    result.open = scan::list_undecided(distances, kMostOpen, counting);
    result.seconds.refine = watch.lap();
    result.census = scan::count_disagreements(distances, counting);
    if (all_decided) {
        result.bounded = {.least = result.census.counts.disagreements(), .undecided = 0};
    }
    result.left_open = result.bounded.undecided;
    result.seconds.count = watch.lap();
    result.selection = scan::select_configurations(distances, options.select, options.per_material,
                                                   control.stage("selecting"));
    // The first that is selected is the strongest of all.
    const auto one = result.selection.empty()
                         ? scan::select_configurations(distances, 1, 1, control.stage("selecting"))
                         : result.selection;
    if (!one.empty()) {
        result.strongest = one.front();
    }
    const bool selection_is_refined =
        refinable || scan::to_refine(distances, select, per_material, scan::Decided::selection,
                                     control.stage("selecting"))
                         .empty();
    // What final distances leave open nothing refines.
    result.selection_is_exact =
        selection_is_refined && (!has_final_bounds(distances) || result.left_open == 0);
    result.exact = result.selection_is_exact && result.left_open == 0 && may_be_exact;
    result.seconds.select = watch.lap();
    control.update("listing", 0);
    result.disagreements = list_disagreements(distances, result.census.counts.disagreements(),
                                              options.disagreements, control);
    control.update("listing", 1);
    result.seconds.list = watch.lap();
    return result;
}

}  // namespace merl::pipeline
