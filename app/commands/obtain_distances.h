#pragma once

#include <tbb/global_control.h>

#include <CLI/CLI.hpp>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/database_options.h"
#include "app/pipeline/pair_distances.h"
#include "engine/database/database.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"

namespace merl::app {

/// What --metrics takes, for the footers of --help.
inline constexpr const char* kMetricsHelp =
    "A metric is a name of the library (merl-scan metrics) or a file that ends in .glsl, with\n"
    "parameters after colons: pawcielab, pawcielab:white=80, ./my_metric.glsl:alpha=0.3:beta=2.\n";

/// The options of every command that needs distances: where from, under which metrics, computed
/// with what.
struct DistanceOptions {
    DatabaseOptions database;
    std::string distances;               // a table or a folder of tiles to read instead
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
    bool refines = true;  // whether it wants the database that distances of a folder are of
};

/// Adds the options of databases, --distances, --metrics, --device, --memory and --threads to a
/// command. Returns --distances.
CLI::Option* add_distance_options(CLI::App& command, DistanceOptions& options,
                                  const MetricNeeds& needs);

/// Adds --device, --memory and --threads alone; the result is the first two.
std::array<CLI::Option*, 2> add_computing_options(CLI::App& command, DistanceOptions& options);

/// Those that say how distances are computed and, if they were given, of which materials on which
/// grid, for summaries.
nlohmann::ordered_json computing_options_json(const DistanceOptions& options);

/// Bounds the processor threads of the program, those of a device on the processor included, as
/// long as the result lives; 0 is no bound.
std::unique_ptr<tbb::global_control> limit_threads(unsigned threads);

/// What computes distances: a database, metrics, and the engines for them.
struct OpenedDatabase {
    std::unique_ptr<engine::Database> database;
    std::vector<engine::Metric> metrics;
    std::unique_ptr<engine::Engines> engines;
};

/// Opens the database for metrics. The device is tried, and every metric of the user's is compiled
/// and tried on it, in processes of their own. Throws Error (input, device) and Interrupted.
OpenedDatabase open_for_distances(const DistanceOptions& options,
                                  std::vector<engine::Metric> metrics,
                                  const pipeline::Control& control);

/// What is to be computed: the metrics of the options, or else those that are needed, of what they
/// open. Throws what open_for_distances() throws, and Error (usage) where they are not as many as
/// are needed.
struct Computation {
    OpenedDatabase opened;
    std::vector<const engine::Metric*> metrics;  // those opened, in order
    std::vector<std::string> left_out;           // metrics of "all", and why, one line each
};
Computation open_computation(const DistanceOptions& options, const MetricNeeds& needs,
                             const pipeline::Control& control);

/// Calls what computes distances; an error for want of memory then says which option bounds it.
void with_memory_advice(const std::function<void()>& compute);

/// The parts of a comma-separated list, in order. Throws Error (usage) when one is empty or occurs
/// twice; `option` is the option's name in that.
std::vector<std::string> split_list(const std::string& list, const std::string& option);

/// Distances, and what can recompute one: null and empty when a table was read, or a folder of
/// tiles whose database cannot be had.
template <typename Distances>
struct Obtained {
    Distances distances;
    std::unique_ptr<engine::Database> database;
    std::vector<engine::Metric> opened;
    std::vector<const engine::Metric*> metrics;  // those opened, in order
    std::unique_ptr<engine::Engines> engines;
};
using ObtainedDistances = Obtained<pipeline::PairDistances>;
using ObtainedListedDistances = Obtained<pipeline::ListedPairDistances>;

/// Computes the distances, every material read once for all metrics, or reads the table or the
/// folder. Prints warnings. Throws Error (usage when there are not as many metrics as needed,
/// input, device) and Interrupted.
ObtainedDistances obtain_distances(const DistanceOptions& options, const MetricNeeds& needs,
                                   const pipeline::Control& control);

/// Which pairs are wanted, of materials with these names: ascending indices, each pair once and one
/// at least. May throw.
using PairsOf = std::function<std::vector<scan::Pair>(std::span<const std::string> names)>;

/// The same for some pairs of the materials, which are asked for as soon as the names are known:
/// of a database only they are computed, of a table they are taken, which need not have others.
/// Throws likewise, what `pairs_of` throws, and InputError where a table lacks a pair.
ObtainedListedDistances obtain_listed_distances(const DistanceOptions& options,
                                                const MetricNeeds& needs, const PairsOf& pairs_of,
                                                const pipeline::Control& control);

/// Warns on standard error, and for summary.json.
void warn(pipeline::Provenance& provenance, const std::string& text);

/// Warns where all distances under a metric are 0, which is a mistake more often than it is true.
/// For distances that are not to be refined any more: float32 may give 0 where float64 does not.
void warn_if_all_are_zero(pipeline::Provenance& provenance, const std::string& metric,
                          std::span<const double> values);

/// The same for every metric of a table.
void warn_if_all_are_zero(pipeline::Provenance& provenance,
                          std::span<const scan::MetricColumn> columns);

}  // namespace merl::app
