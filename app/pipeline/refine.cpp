#include "app/pipeline/refine.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "engine/distance/float64_distances.h"
#include "scan/score/score.h"
#include "scan/select/undecided.h"

namespace merl::pipeline {
namespace {

/// The distances under one metric, to be replaced at some places.
struct OpenColumn {
    const engine::Metric* metric;
    std::span<const std::uint32_t> places;  // ascending
    std::vector<double>* values;
    std::vector<double>* bounds;
};

/// Replaces them by float64 ones, all in one pass; pair_of(place) is the pair at a place.
void replace(std::span<const OpenColumn> columns, const auto& pair_of,
             const engine::Database& database, std::uint64_t memory_bytes,
             const std::function<void(double)>& progress, engine::Engines* engines) {
    std::vector<engine::Float64Request> requests;
    for (const auto& column : columns) {
        auto& request = requests.emplace_back(engine::Float64Request{column.metric, {}});
        for (const auto place : column.places) {
            const scan::Pair pair = pair_of(place);
            request.pairs.emplace_back(pair.first, pair.second);
        }
    }
    const auto exact =
        engines != nullptr
            ? engines->float64_distances(database, requests, progress, memory_bytes)
            : engine::float64_distances(database, requests, engine::VoxelSet::above_horizon,
                                        progress, memory_bytes);
    for (std::size_t c = 0; c < columns.size(); ++c) {
        const auto& [metric, places, values, bounds] = columns[c];
        for (std::size_t i = 0; i < places.size(); ++i) {
            (*values)[places[i]] = exact[c][i];
            (*bounds)[places[i]] = 0;
        }
    }
}

/// The pairs of a table that has all.
auto pairs_of(std::uint32_t materials) {
    return [=](std::uint32_t place) { return scan::pair_at(place, materials); };
}

void require_source_of(const auto& table, const engine::Database& database,
                       std::span<const engine::Metric* const> metrics) {
    if (database.materials() != table.names ||
        !std::ranges::equal(metrics, table.metrics, {}, &engine::Metric::name,
                            &scan::MetricColumn::metric)) {
        throw std::invalid_argument(
            "distances go with the database and the metrics that they were computed from, in the "
            "order of the table");
    }
}

}  // namespace

bool can_refine(const engine::Metric& metric, const engine::Engines* engines) {
    return metric.can_be_refined() && (metric.has_twin() || engines != nullptr);
}

bool can_be_exact(const engine::Metric& metric, const engine::Engines* engines) {
    return metric.is_summary() || can_refine(metric, engines);
}

void require_source(const scan::DistanceTable& table, const engine::Database& database,
                    std::span<const engine::Metric* const> metrics) {
    require_source_of(table, database, metrics);
}

void require_source(const scan::ListedDistances& table, const engine::Database& database,
                    std::span<const engine::Metric* const> metrics) {
    require_source_of(table, database, metrics);
}

Refined refine(scan::Distances& distances, const engine::Database& database,
               const std::array<const engine::Metric*, 2>& metrics, std::uint32_t select,
               std::uint32_t per_material, std::uint64_t memory_bytes,
               const RefineProgress& progress, scan::Decided decided, engine::Engines* engines) {
    Refined refined;
    for (;;) {
        const auto open =
            scan::to_refine(distances, select, per_material, decided, progress.deciding);
        if (open.empty()) {
            return refined;
        }
        if (progress.wanted) {
            progress.wanted(open.first.size() + open.second.size());
        }
        const std::array<OpenColumn, 2> columns = {
            OpenColumn{metrics[0], open.first, &distances.first, &distances.first_bounds},
            OpenColumn{metrics[1], open.second, &distances.second, &distances.second_bounds}};
        replace(columns, pairs_of(distances.materials()), database, memory_bytes, progress.refining,
                engines);
        refined.first += open.first.size();
        refined.second += open.second.size();
    }
}

std::vector<std::uint64_t> refine_judged(scan::DistanceTable& table,
                                         const scan::Judgements& judgements,
                                         const engine::Database& database,
                                         std::span<const engine::Metric* const> metrics,
                                         std::uint64_t memory_bytes,
                                         const std::function<void(double)>& progress,
                                         engine::Engines* engines) {
    std::vector<OpenColumn> columns;
    std::vector<std::vector<std::uint32_t>> open(metrics.size());
    std::vector<std::uint64_t> refined(metrics.size());
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        auto& column = table.metrics[m];
        if (can_refine(*metrics[m], engines)) {
            open[m] = scan::open_pairs(judgements, {column.metric, column.values, column.bounds});
        }
        if (!open[m].empty()) {
            columns.push_back({metrics[m], open[m], &column.values, &column.bounds});
        }
        refined[m] = open[m].size();
    }
    if (!columns.empty()) {
        replace(columns, pairs_of(table.materials()), database, memory_bytes, progress, engines);
    }
    return refined;
}

void make_exact(scan::ListedDistances& table, const engine::Database& database,
                std::span<const engine::Metric* const> metrics,
                std::span<const std::vector<std::uint32_t>> entries, std::uint64_t memory_bytes,
                const std::function<void(double)>& progress, engine::Engines* engines) {
    require_source(table, database, metrics);
    if (entries.size() != metrics.size()) {
        throw std::invalid_argument("expected a list of entries for each metric");
    }
    std::vector<OpenColumn> columns;
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        if (entries[m].empty()) {
            continue;
        }
        if (!can_refine(*metrics[m], engines)) {
            throw std::invalid_argument(metrics[m]->name + ": nothing makes its distances exact");
        }
        auto& column = table.metrics[m];
        columns.push_back({metrics[m], entries[m], &column.values, &column.bounds});
    }
    if (!columns.empty()) {
        replace(
            columns, [&](std::uint32_t place) { return table.pairs.at(place); }, database,
            memory_bytes, progress, engines);
    }
}

}  // namespace merl::pipeline
