#include "app/pipeline/refine.h"

#include <algorithm>
#include <stdexcept>
#include <vector>

#include "engine/distance/float64_distances.h"
#include "scan/score/score.h"
#include "scan/select/undecided.h"

namespace merl::pipeline {
namespace {

engine::Float64Request request(const engine::Metric& metric,
                               const std::vector<std::uint32_t>& pairs, std::uint32_t materials) {
    engine::Float64Request result = {&metric, {}};
    for (const auto index : pairs) {
        const auto pair = scan::pair_at(index, materials);
        result.pairs.emplace_back(pair.first, pair.second);
    }
    return result;
}

void replace(const std::vector<std::uint32_t>& pairs, const std::vector<double>& exact,
             std::vector<double>& values, std::vector<double>& bounds) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        values[pairs[i]] = exact[i];
        bounds[pairs[i]] = 0;
    }
}

}  // namespace

void require_source(const scan::DistanceTable& table, const engine::Database& database,
                    std::span<const engine::Metric* const> metrics) {
    if (database.materials() != table.names ||
        !std::ranges::equal(metrics, table.metrics, {}, &engine::Metric::name,
                            &scan::MetricColumn::metric)) {
        throw std::invalid_argument(
            "distances go with the database and the metrics that they were computed from, in the "
            "order of the table");
    }
}

Refined refine(scan::Distances& distances, const engine::Database& database,
               const std::array<const engine::Metric*, 2>& metrics, std::uint32_t select,
               std::uint32_t per_material, std::uint64_t memory_bytes,
               const std::function<void(double)>& progress) {
    Refined refined;
    for (;;) {
        const auto open = scan::to_refine(distances, select, per_material);
        if (open.empty()) {
            return refined;
        }
        const std::array<engine::Float64Request, 2> requests = {
            request(*metrics[0], open.first, distances.materials()),
            request(*metrics[1], open.second, distances.materials())};
        const auto exact = engine::float64_distances(
            database, requests, engine::VoxelSet::above_horizon, progress, memory_bytes);
        replace(open.first, exact[0], distances.first, distances.first_bounds);
        replace(open.second, exact[1], distances.second, distances.second_bounds);
        refined.first += open.first.size();
        refined.second += open.second.size();
    }
}

std::vector<std::uint64_t> refine_judged(scan::DistanceTable& table,
                                         const scan::Judgements& judgements,
                                         const engine::Database& database,
                                         std::span<const engine::Metric* const> metrics,
                                         std::uint64_t memory_bytes,
                                         const std::function<void(double)>& progress) {
    std::vector<engine::Float64Request> requests;
    std::vector<std::vector<std::uint32_t>> open(metrics.size());
    std::vector<std::uint64_t> refined(metrics.size());
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        const auto& column = table.metrics[m];
        if (metrics[m]->has_twin() && !metrics[m]->is_summary()) {
            open[m] = scan::open_pairs(judgements, {column.metric, column.values, column.bounds});
        }
        if (!open[m].empty()) {
            requests.push_back(request(*metrics[m], open[m], table.materials()));
        }
        refined[m] = open[m].size();
    }
    if (requests.empty()) {
        return refined;
    }
    const auto exact = engine::float64_distances(
        database, requests, engine::VoxelSet::above_horizon, progress, memory_bytes);
    auto next = exact.begin();
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        if (!open[m].empty()) {
            replace(open[m], *next++, table.metrics[m].values, table.metrics[m].bounds);
        }
    }
    return refined;
}

}  // namespace merl::pipeline
