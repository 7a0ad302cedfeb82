#include "app/commands/tiled_distances.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "app/output/provenance.h"
#include "app/output/scan_record.h"
#include "app/pipeline/metrics.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/database/content_hash.h"

namespace merl::app {
namespace {

/// Those of the provenance, as they were. Throws Error where one is not there any more, and says
/// which where it is another.
std::vector<engine::Metric> reopen_metrics(const TileManifest& manifest,
                                           const pipeline::Provenance& provenance) {
    std::vector<engine::Metric> metrics;
    for (const auto& wanted : provenance.metrics) {
        const auto place = std::ranges::find(manifest.provenance.metrics, wanted.name,
                                             &pipeline::MetricProvenance::name) -
                           manifest.provenance.metrics.begin();
        const auto& recorded = manifest.metrics.at(static_cast<std::size_t>(place));
        const std::string texts[] = {recorded.text};
        auto opened = pipeline::open_metrics(texts);
        if (opened.size() != 1 || opened.front().name != wanted.name ||
            hash_of(opened.front().source) != recorded.source_hash) {
            throw InputError(fmt::format("{}: the metric is not what it was", recorded.text));
        }
        metrics.push_back(std::move(opened.front()));
    }
    return metrics;
}

/// Whether float64 could make any distance more exact.
bool can_be_refined(const std::vector<engine::Metric>& metrics) {
    return std::ranges::any_of(metrics, [](const engine::Metric& metric) {
        return metric.has_twin() && !metric.is_summary();
    });
}

}  // namespace

std::vector<std::string> tile_columns(const TileFolder& folder, const DistanceOptions& options,
                                      const MetricNeeds& needs) {
    std::vector<std::string> all;
    for (const auto& metric : folder.manifest().provenance.metrics) {
        all.push_back(metric.name);
    }
    const bool suits = all.size() >= needs.least && all.size() <= needs.most;
    const std::string wanted = options.metrics.value_or(
        suits || needs.from_database == "all" ? "all" : needs.from_database);
    return wanted == "all" ? all : split_list(wanted, "--metrics");
}

TileSource reopen_source(const TileFolder& folder, pipeline::Provenance& provenance,
                         const DistanceOptions& options, const pipeline::Control& control) {
    TileSource source;
    auto database = options.database;
    const bool is_named = !database.databases.empty();
    try {
        source.metrics = reopen_metrics(folder.manifest(), provenance);
        if (!can_be_refined(source.metrics)) {
            return {};
        }
        const auto record = record_of(source_json(provenance), folder.manifest_path());
        database.otherwise = is_named ? recorded_grid(record) : recorded_choice(record);
        if (!is_named) {
            source.database = open_database(database);
        }
    } catch (const Error& error) {
        provenance.warnings.push_back(fmt::format(
            "{}; distances are not refined, and decide within their bounds", error.what()));
        return {};
    }
    if (is_named) {
        source.database = open_database(database);
    }
    if (source.database->materials() != folder.manifest().materials() ||
        content_hash_of(*source.database, control.stage("checking the database")) !=
            provenance.database->content_hash) {
        throw InputError(fmt::format(
            "{}: the content is not what {} was computed from; --database names that, and scan "
            "--fast does without it",
            source.database->name(), folder.manifest_path()));
    }
    return source;
}

}  // namespace merl::app
