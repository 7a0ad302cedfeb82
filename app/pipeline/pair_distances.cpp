#include "app/pipeline/pair_distances.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>
#include <stdexcept>
#include <utility>

#include "app/pipeline/version.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/database/bad_files.h"
#include "scan/io/input.h"

namespace merl::pipeline {
namespace {

/// Distances, whichever pairs they are of.
struct Computed {
    std::vector<scan::MetricColumn> columns;
    Provenance provenance;
};

/// Of all pairs, or of those that are listed.
Computed compute(engine::Engines& engines, const engine::Database& database,
                 std::span<const engine::Metric* const> metrics,
                 std::span<const engine::MaterialPair> pairs, std::uint64_t memory_bytes,
                 const Control& control) {
    require_pairs(database);
    auto computed = engine::compute_distances(
        engines, database, metrics,
        {.memory_bytes = memory_bytes, .pairs = pairs, .progress = control.stage("distances")});
    Computed result;
    auto& provenance = result.provenance;
    provenance.version = kVersion;
    provenance.database = provenance_of(database, computed);
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        provenance.metrics.push_back(provenance_of(*metrics[m]));
        result.columns.push_back({metrics[m]->name, std::move(computed.distances[m].values),
                                  std::move(computed.distances[m].bounds),
                                  metrics[m]->is_summary()});
    }
    for (const auto& use : computed.engines) {
        auto& engine = provenance.engines.emplace_back(
            EngineProvenance{.engine = use.engine, .metrics = {}, .peak_bytes = use.peak_bytes});
        for (const auto m : use.metrics) {
            engine.metrics.push_back(metrics[m]->name);
        }
    }
    provenance.slabs = computed.slabs;
    provenance.seconds = computed.seconds;
    provenance.warnings = engine::skipped_lines(database);
    std::ranges::move(computed.warnings, std::back_inserter(provenance.warnings));
    return result;
}

/// `parse(text, report)` makes a table of what is in the file.
template <typename Distances>
Distances read(const std::string& file, const Control& control, const auto& parse) {
    Stopwatch watch;
    const std::string text = scan::read_input(file);
    Distances result;
    result.table = parse(text, control.stage("reading"));
    auto& provenance = result.provenance;
    provenance.version = kVersion;
    provenance.table = {file, hash_of(text)};
    for (const auto& column : result.table.metrics) {
        provenance.metrics.push_back({.name = column.metric, .is_computed = false});
    }
    provenance.seconds.total = watch.lap();
    return result;
}

}  // namespace

void require_pairs(const engine::Database& database) {
    if (database.materials().size() < 2) {
        const auto skipped = engine::reasons(database.skipped());
        throw InputError(
            fmt::format("{}: found {} material{}; distances need at least two{}{}", database.name(),
                        database.materials().size(), database.materials().size() == 1 ? "" : "s",
                        skipped.empty() ? "" : "; left out: ", fmt::join(skipped, "; ")));
    }
    engine::require_usable(database);
}

MetricProvenance provenance_of(const engine::Metric& metric) {
    const auto& header = metric.header;
    MetricProvenance result = {.name = metric.name,
                               .title = header.title,
                               .formula = header.formula,
                               .source = header.source,
                               .note = header.note,
                               .parameters = {},
                               .fitted = header.fitted,
                               .is_pseudometric = metric.is_pseudometric(),
                               .refined_by = !metric.can_be_refined() ? ""
                                             : metric.has_twin()      ? "host"
                                                                      : "vulkan",
                               .accuracy = metric.is_summary()  ? "float64"
                                           : metric.has_bound() ? "float32 with a proven bound"
                                                                : "float32 without a bound"};
    for (std::size_t p = 0; p < header.parameters.size(); ++p) {
        result.parameters.emplace_back(header.parameters[p].name, metric.parameters[p]);
    }
    return result;
}

DatabaseProvenance provenance_of(const engine::Database& database,
                                 const engine::DistanceResult& computed) {
    DatabaseProvenance result = {.name = database.name(),
                                 .kind = database.kind(),
                                 .path = database.path(),
                                 .content_hash = computed.content_hash,
                                 .grid = database.grid(),
                                 .voxels = computed.voxels,
                                 .materials = {},
                                 .parts = {},
                                 .skipped = database.skipped()};
    for (std::size_t m = 0; m < database.materials().size(); ++m) {
        result.materials.push_back({database.materials()[m], computed.material_hashes[m],
                                    computed.counts[m].negative,
                                    computed.counts[m].negative_above_horizon});
    }
    for (std::size_t p = 0; p < database.parts().size(); ++p) {
        const auto& part = database.parts()[p];
        result.parts.push_back(
            {part.label, part.name, part.kind, part.path, computed.part_hashes[p], part.materials});
    }
    return result;
}

PairDistances compute_pair_distances(engine::Engines& engines, const engine::Database& database,
                                     std::span<const engine::Metric* const> metrics,
                                     std::uint64_t memory_bytes, const Control& control) {
    auto [columns, provenance] = compute(engines, database, metrics, {}, memory_bytes, control);
    return {.table = {.names = database.materials(), .metrics = std::move(columns)},
            .provenance = std::move(provenance)};
}

ListedPairDistances compute_listed_distances(engine::Engines& engines,
                                             const engine::Database& database,
                                             std::span<const engine::Metric* const> metrics,
                                             std::span<const scan::Pair> pairs,
                                             std::uint64_t memory_bytes, const Control& control) {
    if (pairs.empty()) {
        throw std::invalid_argument("found no pairs; expected one or more");
    }
    std::vector<engine::MaterialPair> listed;
    for (const auto& pair : pairs) {
        listed.emplace_back(pair.first, pair.second);
    }
    auto [columns, provenance] = compute(engines, database, metrics, listed, memory_bytes, control);
    return {.table = {.names = database.materials(),
                      .pairs = {pairs.begin(), pairs.end()},
                      .metrics = std::move(columns)},
            .provenance = std::move(provenance)};
}

PairDistances read_pair_distances(const std::string& file, std::span<const std::string> columns,
                                  const Control& control) {
    return read<PairDistances>(file, control, [&](const std::string& text, const auto& report) {
        return scan::parse_distance_table(text, file, columns, report);
    });
}

ListedPairDistances read_listed_distances(const std::string& file,
                                          std::span<const std::string> columns,
                                          const Control& control) {
    return read<ListedPairDistances>(
        file, control, [&](const std::string& text, const auto& report) {
            return scan::parse_listed_distances(text, file, columns, report);
        });
}

ListedPairDistances pick_distances(ListedPairDistances distances,
                                   std::span<const scan::Pair> pairs) {
    auto& table = distances.table;
    std::vector<std::size_t> places;
    const scan::Pair* missing = nullptr;
    for (const auto& pair : pairs) {
        if (const auto place = table.place_of(pair)) {
            places.push_back(*place);
        } else if (missing == nullptr) {
            missing = &pair;
        }
    }
    if (missing != nullptr) {
        throw InputError(fmt::format(
            R"({}: found the distances of {} of {} pairs that are needed; add the others, such as "{}" and "{}")",
            distances.provenance.table ? distances.provenance.table->file : "distances",
            places.size(), pairs.size(), table.names[missing->first],
            table.names[missing->second]));
    }
    table.pairs.assign(pairs.begin(), pairs.end());
    const auto pick = [&](std::vector<double>& numbers) {
        std::vector<double> picked;
        picked.reserve(places.size());
        for (const auto place : places) {
            picked.push_back(numbers[place]);
        }
        numbers = std::move(picked);
    };
    for (auto& column : table.metrics) {
        pick(column.values);
        if (!column.bounds.empty()) {
            pick(column.bounds);
        }
    }
    return distances;
}

}  // namespace merl::pipeline
