#include "app/pipeline/pair_distances.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "app/pipeline/version.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/database/bad_files.h"
#include "scan/io/input.h"

namespace merl::pipeline {
namespace {

MetricProvenance provenance_of(const engine::Metric& metric) {
    const auto& header = metric.header;
    MetricProvenance result = {.name = metric.name,
                               .title = header.title,
                               .formula = header.formula,
                               .source = header.source,
                               .note = header.note,
                               .parameters = {},
                               .fitted = header.fitted,
                               .is_pseudometric = metric.is_pseudometric()};
    for (std::size_t p = 0; p < header.parameters.size(); ++p) {
        result.parameters.emplace_back(header.parameters[p].name, metric.parameters[p]);
    }
    return result;
}

}  // namespace

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
    if (database.materials().size() < 2) {
        const auto skipped = engine::reasons(database.skipped());
        throw InputError(
            fmt::format("{}: found {} material{}; distances need at least two{}{}", database.name(),
                        database.materials().size(), database.materials().size() == 1 ? "" : "s",
                        skipped.empty() ? "" : "; left out: ", fmt::join(skipped, "; ")));
    }
    engine::require_usable(database);
    auto computed = engine::compute_distances(
        engines, database, metrics,
        {.memory_bytes = memory_bytes, .progress = control.stage("distances")});
    PairDistances result;
    auto& provenance = result.provenance;
    provenance.version = kVersion;
    provenance.database = provenance_of(database, computed);
    result.table.names = database.materials();
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        provenance.metrics.push_back(provenance_of(*metrics[m]));
        result.table.metrics.push_back({metrics[m]->name, std::move(computed.distances[m].values),
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

PairDistances read_pair_distances(const std::string& file, std::span<const std::string> columns,
                                  const Control& control) {
    Stopwatch watch;
    const std::string text = scan::read_input(file);
    PairDistances result;
    result.table = scan::parse_distance_table(text, file, columns, control.stage("reading"));
    auto& provenance = result.provenance;
    provenance.version = kVersion;
    provenance.table = {file, hash_of(text)};
    for (const auto& column : result.table.metrics) {
        provenance.metrics.push_back({.name = column.metric, .is_computed = false});
    }
    provenance.seconds.total = watch.lap();
    return result;
}

}  // namespace merl::pipeline
