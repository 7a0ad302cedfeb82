#include "app/pipeline/refine.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>
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

/// What a distance takes while it is computed (float64_distances.h), about. Of ten thousand
/// materials a hundred million may be open.
constexpr std::uint64_t kBytesADistance = 80;

std::size_t places_of(std::span<const OpenColumn> columns) {
    std::size_t count = 0;
    for (const auto& column : columns) {
        count += column.places.size();
    }
    return count;
}

/// Takes away the first places, at most so many, all up to the same place: what is of one pair
/// stays together.
std::vector<OpenColumn> take_first(std::vector<OpenColumn>& columns, std::size_t most) {
    const std::size_t of_each = std::max<std::size_t>(1, most / columns.size());
    std::uint32_t last = std::numeric_limits<std::uint32_t>::max();
    for (const auto& column : columns) {
        if (column.places.size() > of_each) {
            last = std::min(last, column.places[of_each - 1]);
        }
    }
    auto first = columns;
    for (std::size_t c = 0; c < columns.size(); ++c) {
        const auto& places = columns[c].places;
        const auto count =
            static_cast<std::size_t>(std::ranges::upper_bound(places, last) - places.begin());
        first[c].places = places.first(count);
        columns[c].places = places.subspan(count);
    }
    return first;
}

/// Replaces them by float64 ones, in one pass; pair_of(place) is the pair at a place.
void replace_at_once(std::span<const OpenColumn> columns, const auto& pair_of,
                     const engine::Database& database, std::uint64_t memory_bytes,
                     const std::function<void(double)>& progress, engine::Engines* engines) {
    std::vector<engine::Float64Request> requests;
    for (const auto& column : columns) {
        auto& request = requests.emplace_back(engine::Float64Request{column.metric, {}});
        request.pairs.reserve(column.places.size());
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

/// The same of any number, in pieces that take a quarter of the memory at most: no bit of a
/// distance depends on what else is asked for.
void replace(std::vector<OpenColumn> columns, const auto& pair_of, const engine::Database& database,
             std::uint64_t memory_bytes, const std::function<void(double)>& progress,
             engine::Engines* engines) {
    const auto all = static_cast<double>(places_of(columns));
    for (double done = 0; places_of(columns) > 0;) {
        const auto piece = take_first(columns, memory_bytes / 4 / kBytesADistance);
        const auto size = places_of(piece);
        replace_at_once(
            piece, pair_of, database, memory_bytes - std::min(memory_bytes, size * kBytesADistance),
            [&](double share) {
                if (progress) {
                    progress((done + share * static_cast<double>(size)) / all);
                }
            },
            engines);
        done += static_cast<double>(size);
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
        replace({{metrics[0], open.first, &distances.first, &distances.first_bounds},
                 {metrics[1], open.second, &distances.second, &distances.second_bounds}},
                pairs_of(distances.materials()), database, memory_bytes, progress.refining,
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
        replace(std::move(columns), pairs_of(table.materials()), database, memory_bytes, progress,
                engines);
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
            std::move(columns), [&](std::uint32_t place) { return table.pairs.at(place); },
            database, memory_bytes, progress, engines);
    }
}

}  // namespace merl::pipeline
