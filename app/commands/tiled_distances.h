#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/commands/obtain_distances.h"
#include "app/output/tile_folder.h"
#include "app/pipeline/control.h"
#include "app/pipeline/pair_distances.h"
#include "engine/database/database.h"
#include "engine/metric/metric.h"

namespace merl::app {

// Distances that `merl-scan distances` computed, as other commands use them.

/// The metrics that are meant: those of the options; without them all that the folder has, where a
/// command can do with as many, otherwise those that it takes from a database. Throws Error
/// (usage).
std::vector<std::string> tile_columns(const TileFolder& folder, const DistanceOptions& options,
                                      const MetricNeeds& needs);

/// What distances can be refined from: their database and metrics, in the order of `provenance`;
/// null and empty where it cannot be had.
struct TileSource {
    std::unique_ptr<engine::Database> database;
    std::vector<engine::Metric> metrics;
};

/// Opens it, where --database says or else the manifest, and reads all of it to see whether it is
/// what the tiles are of. Where it cannot be reached, or a metric's file is another by now, warns
/// in `provenance`. Throws InputError where it is not what the tiles are of, or --database cannot
/// be opened.
TileSource reopen_source(const TileFolder& folder, pipeline::Provenance& provenance,
                         const DistanceOptions& options, const pipeline::Control& control);

}  // namespace merl::app
