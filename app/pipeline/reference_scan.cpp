#include "app/pipeline/reference_scan.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "app/pipeline/refine.h"
#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "scan/select/disagreements.h"

namespace merl::pipeline {
namespace {

void require_listable(const scan::ReferenceDistances& distances) {
    std::uint64_t configurations = 0;
    for (const auto& range : distances.ranges) {
        configurations += scan::pair_count(range.size());
    }
    if (configurations > scan::max_listed) {
        throw InputError(
            fmt::format("{} configurations of originals and two of their approximations are more "
                        "than can be listed ({}); take fewer of the materials",
                        configurations, scan::max_listed));
    }
}

/// Until nothing is left open that can be refined; returns how many distances it took, by metric.
std::vector<std::uint64_t> refine(scan::ReferenceDistances& distances,
                                  const engine::Database& database,
                                  std::span<const engine::Metric* const> metrics,
                                  const ScanOptions& options, const Control& control) {
    std::vector<bool> can_be_refined;
    for (const auto* metric : metrics) {
        can_be_refined.push_back(can_refine(*metric, options.engines));
    }
    std::vector<std::uint64_t> refined(metrics.size());
    for (;;) {
        // The strongest disagreement is shown, so at least one is selected.
        const auto open = scan::to_refine(distances, can_be_refined, std::max(1U, options.select),
                                          std::max(1U, options.per_material));
        if (std::ranges::all_of(open, &std::vector<std::uint32_t>::empty)) {
            return refined;
        }
        make_exact(distances.table, database, metrics, open, options.memory_bytes,
                   control.stage("refining"), options.engines);
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            refined[m] += open[m].size();
        }
    }
}

}  // namespace

ReferenceScanResult scan_reference(scan::ListedDistances table, scan::Approximations approximations,
                                   const engine::Database* database,
                                   std::span<const engine::Metric* const> metrics,
                                   const ScanOptions& options, const Control& control) {
    if (table.metrics.size() < 2) {
        throw std::invalid_argument(
            fmt::format("a table of {} metrics: a scan takes two or more", table.metrics.size()));
    }
    if (database != nullptr) {
        require_source(table, *database, metrics);
    }
    ReferenceScanResult result;
    Stopwatch watch;
    auto& distances = result.distances;
    distances = scan::reference_distances(std::move(table), std::move(approximations));
    require_listable(distances);
    result.undecided = scan::find_undecided(distances, 0).configurations;
    result.refined.resize(distances.table.metrics.size());
    for (const auto* metric : metrics) {
        if (!metric->has_bound()) {
            result.unbounded.push_back(metric->name);
        }
    }
    if (!options.fast && database != nullptr) {
        result.refined = refine(distances, *database, metrics, options, control);
    }
    result.left_open = scan::find_undecided(distances, kMostOpen);
    result.exact = !options.fast && result.left_open.configurations == 0 &&
                   std::ranges::all_of(metrics, [&](const engine::Metric* metric) {
                       return can_be_exact(*metric, options.engines);
                   });
    result.seconds.refine = watch.lap();
    result.counts = scan::count_configurations(distances, 0, 1);
    result.summary = scan::summarise(distances, kHardest);
    result.seconds.count = watch.lap();
    control.update("listing", 0);
    result.disagreements = scan::disagreements_of(distances);
    if (result.disagreements.size() != result.counts.disagreements()) {
        throw std::logic_error(fmt::format("{} disagreements were counted and {} listed",
                                           result.counts.disagreements(),
                                           result.disagreements.size()));
    }
    control.update("listing", 1);
    result.seconds.list = watch.lap();
    result.selection =
        scan::select_of(distances, result.disagreements, options.select, options.per_material);
    if (!result.disagreements.empty()) {
        result.strongest = result.disagreements.front();
    }
    if (options.disagreements && *options.disagreements < result.disagreements.size()) {
        result.disagreements.resize(*options.disagreements);
    }
    result.seconds.select = watch.lap();
    return result;
}

}  // namespace merl::pipeline
