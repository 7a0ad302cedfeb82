#include "app/pipeline/scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "scan/select/disagreements.h"
#include "scan/select/selection.h"
#include "scan/select/undecided.h"

namespace merl::pipeline {
namespace {

std::vector<scan::Configuration> list_disagreements(const scan::Distances& distances,
                                                    std::uint64_t counted,
                                                    std::optional<std::uint64_t> wanted,
                                                    const Control& control) {
    const auto listed = std::min(wanted.value_or(counted), counted);
    if (listed > scan::max_listed) {
        throw TooManyDisagreements(fmt::format("{} disagreements are more than can be listed ({})",
                                               listed, scan::max_listed));
    }
    const auto progress = control.stage("listing");
    if (wanted) {
        return scan::strongest_disagreements(distances, *wanted, progress);
    }
    auto all = scan::all_disagreements(distances, progress);
    if (all.size() != counted) {
        throw std::logic_error(
            fmt::format("{} disagreements were counted and {} listed", counted, all.size()));
    }
    return all;
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
    result.undecided = scan::count_undecided(distances);
    const auto both = metrics.first(std::min<std::size_t>(metrics.size(), 2));
    result.exact = !options.fast && (database != nullptr || result.undecided == 0) &&
                   std::ranges::all_of(both, [&](const engine::Metric* metric) {
                       return can_be_exact(*metric, options.engines);
                   });
    result.left_open = result.undecided;
    for (const auto* metric : both) {
        if (!metric->has_bound()) {
            result.unbounded.push_back(metric->name);
        }
    }
    if (result.exact && database != nullptr) {
        // The strongest disagreement is shown, so at least one is selected.
        result.refined = refine(distances, *database, {metrics[0], metrics[1]},
                                std::max(1U, options.select), std::max(1U, options.per_material),
                                options.memory_bytes, control.stage("refining"), options.engines);
        result.left_open = scan::count_undecided(distances);
        result.exact = result.left_open == 0;
    }
    result.open = scan::list_undecided(distances, kMostOpen);
    result.seconds.refine = watch.lap();
    result.census = scan::count_disagreements(distances);
    result.seconds.count = watch.lap();
    result.selection = scan::select_configurations(distances, options.select, options.per_material);
    if (const auto one = scan::strongest_disagreements(distances, 1); !one.empty()) {
        result.strongest = one.front();
    }
    result.seconds.select = watch.lap();
    control.update("listing", 0);
    result.disagreements = list_disagreements(distances, result.census.counts.disagreements(),
                                              options.disagreements, control);
    control.update("listing", 1);
    result.seconds.list = watch.lap();
    return result;
}

}  // namespace merl::pipeline
