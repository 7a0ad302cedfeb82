#pragma once

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/database/database.h"
#include "engine/metric/metric.h"
#include "scan/pairs/distance_table.h"

namespace merl::app {

/// The options of every command that needs distances: where from, under which metrics, computed
/// with what.
struct DistanceOptions {
    std::string database;                // a directory; the built-in database when empty
    std::string distances;               // a table to read instead
    std::optional<std::string> metrics;  // separated by commas, or "all"
    std::string device;
    std::uint64_t memory = 1ULL << 30U;
    unsigned threads = 0;  // 0: as many as there are processors
};

/// The metrics that a command works with.
struct MetricNeeds {
    std::string from_database;  // what --metrics is without the option; a table gives all it has
    std::size_t least = 1;
    std::size_t most = 1000;
};

/// Adds --database, --distances, --metrics, --device, --memory and --threads to a command. Returns
/// --distances.
CLI::Option* add_distance_options(CLI::App& command, DistanceOptions& options,
                                  const MetricNeeds& needs);

/// Bounds the processor threads of the program, those of a device on the processor included, as
/// long as the result lives; 0 is no bound.
std::unique_ptr<tbb::global_control> limit_threads(unsigned threads);

/// Distances, and where they are from.
struct ObtainedDistances {
    scan::DistanceTable table;  // bounds are empty when it was read: its numbers count as exact

    // Null and empty when the table was read; otherwise what can recompute a distance.
    std::unique_ptr<engine::Database> database;
    std::vector<engine::Metric> opened;
    std::vector<const engine::Metric*> metrics;  // those opened, in order

    /// Per metric: its name, and of a computed one title, formula, source, note and
    /// parameters (name and value of each).
    nlohmann::ordered_json described_metrics = nlohmann::ordered_json::array();
    /// For the summary: what is known of the database or the table, the parts of the distance stage
    /// and the device.
    nlohmann::ordered_json source = nlohmann::ordered_json::object();
    nlohmann::ordered_json device = nlohmann::ordered_json::object();
    /// What the user should know of the input: printed already, and for the summary.
    std::vector<std::string> warnings;
    /// For people: title and text of a line each, of the source and of the device.
    std::vector<std::pair<std::string, std::string>> source_lines;
    std::vector<std::pair<std::string, std::string>> device_lines;

    double device_seconds = 0;    // opening the device
    double distance_seconds = 0;  // computing or reading
};

/// Computes the distances on a device, every material read once for all metrics, or reads the
/// table. Shows progress unless `quiet`. Throws Error (usage when there are not as many metrics as
/// needed, input, device), InputError and Interrupted.
ObtainedDistances obtain_distances(const DistanceOptions& options, const MetricNeeds& needs,
                                   bool quiet);

/// Warns on standard error, and for summary.json.
void warn(ObtainedDistances& obtained, const std::string& text);

/// Warns where all distances under a metric are 0, which is a
/// mistake more often than it is true. For distances that are not to be refined any more: float32
/// may give 0 where float64 does not.
void warn_if_all_are_zero(ObtainedDistances& obtained, const std::string& metric,
                          std::span<const double> distances);

/// The same for every metric of its table.
void warn_if_all_are_zero(ObtainedDistances& obtained);

}  // namespace merl::app
