#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "app/pipeline/control.h"
#include "engine/database/database.h"
#include "engine/distance/distances.h"
#include "engine/metric/metric.h"
#include "scan/pairs/distance_table.h"
#include "scan/pairs/listed_distances.h"
#include "scan/pairs/pairs.h"

namespace merl::pipeline {

// The first step of everything: the distances of pairs of materials, and where they are from.

/// What is known of a material that was read.
struct MaterialProvenance {
    std::string name;
    std::string content_hash;                  // of its samples, without its name
    std::uint64_t negative = 0;                // samples with at least one negative channel
    std::uint64_t negative_above_horizon = 0;  // of them, where a metric would have seen them
};

/// One of the databases that were joined.
struct PartProvenance {
    std::string label;
    std::string name;  // this and what follows as if it was alone
    std::string kind;
    std::string path;
    std::string content_hash;
    std::size_t materials = 0;
};

/// The database of which distances were computed, as it was when it was read.
struct DatabaseProvenance {
    std::string name;
    std::string kind;
    std::string path;          // absolute; empty for one that is not in a file
    std::string content_hash;  // of all materials
    engine::Grid grid;
    std::uint64_t voxels = 0;                   // above the horizon
    std::vector<MaterialProvenance> materials;  // ascending by name, as in the table
    std::vector<PartProvenance> parts;          // none: it is one by itself
    std::vector<engine::BadMaterial> skipped;   // what was left out because it cannot be used
};

/// A file that distances were read from, instead of a database.
struct TableProvenance {
    std::string file;          // as it was named
    std::string content_hash;  // of its bytes
};

/// A folder of tiles that they were read from (distance_tiles.h).
struct TilesProvenance {
    std::string folder;
    std::string content_hash;  // of its manifest
    std::uint64_t tiles = 0;
};

/// A metric under which there are distances.
struct MetricProvenance {
    std::string name;         // with the parameters that are not the default ones
    bool is_computed = true;  // otherwise only the name is known
    std::string title = {}, formula = {}, source = {}, note = {};
    std::vector<std::pair<std::string, double>> parameters = {};
    std::vector<engine::FittedTo> fitted = {};
    bool is_pseudometric = false;  // by proof (engine::Metric)
    std::string refined_by = {};   // what refines its distances: "host", "vulkan"; empty: nothing
    std::string accuracy = {};     // of its distances, for people: "float64" ...; empty: not known
};

/// An engine that computed distances: this processor, or a device.
struct EngineProvenance {
    engine::EngineDescription engine;
    std::vector<std::string> metrics;  // that it computed
    std::uint64_t peak_bytes = 0;      // of memory held for that
};

/// Where distances are from: everything that a result has to say of it.
struct Provenance {
    std::string version;                         // of the program
    std::optional<DatabaseProvenance> database;  // one of these two
    std::optional<TableProvenance> table;
    std::optional<TilesProvenance> tiles;  // beside the database of which they are
    std::vector<MetricProvenance> metrics;
    std::vector<std::string> left_out;      // metrics of "all", and why, one line each
    std::vector<EngineProvenance> engines;  // none for a table
    std::uint64_t slabs = 0;
    engine::DistanceSeconds seconds;
    std::vector<std::string> warnings;  // one line each, for the user
};

/// The distances of all pairs of materials.
struct PairDistances {
    scan::DistanceTable table;  // bounds are empty for a table: its numbers count as exact
    Provenance provenance;
};

/// The distances of some pairs of materials.
struct ListedPairDistances {
    scan::ListedDistances table;  // bounds as above
    Provenance provenance;
};

/// Throws InputError for a database that cannot be used or has fewer than two materials.
void require_pairs(const engine::Database& database);

/// What is known of a metric that computes.
MetricProvenance provenance_of(const engine::Metric& metric);

/// What is known of a database of which distances were computed.
DatabaseProvenance provenance_of(const engine::Database& database,
                                 const engine::DistanceResult& computed);

/// Computes the distances of all pairs of a database under some metrics, each material read once.
/// The stage is "distances". Throws InputError for a database that cannot be used or has fewer than
/// two materials, Error (device) and NoDriverError where no device will do (engine/distance/
/// engines.h), MemoryError, and Cancelled.
PairDistances compute_pair_distances(engine::Engines& engines, const engine::Database& database,
                                     std::span<const engine::Metric* const> metrics,
                                     std::uint64_t memory_bytes = 1ULL << 30U,
                                     const Control& control = {});

/// The distances of these pairs alone, indices into the database's materials in the order that
/// ListedDistances has: time and memory grow with their number. Each distance has the bits that it
/// has among all. Every material is read all the same, for its hash and its counts. Throws
/// likewise, and std::invalid_argument for pairs out of order.
ListedPairDistances compute_listed_distances(engine::Engines& engines,
                                             const engine::Database& database,
                                             std::span<const engine::Metric* const> metrics,
                                             std::span<const scan::Pair> pairs,
                                             std::uint64_t memory_bytes = 1ULL << 30U,
                                             const Control& control = {});

/// Reads those of all pairs from a CSV file (distance_table.h), all columns or those that are
/// named. The stage is "reading". Throws InputError and Cancelled.
PairDistances read_pair_distances(const std::string& file,
                                  std::span<const std::string> columns = {},
                                  const Control& control = {});

/// Takes some pairs, ascending, out of distances that have them. Throws InputError, which says how
/// many there are not and names one, where `distances` lack some.
ListedPairDistances pick_distances(ListedPairDistances distances,
                                   std::span<const scan::Pair> pairs);

/// Reads the distances of pairs from a CSV file, all columns or those that are named. The stage is
/// "reading". Throws InputError and Cancelled.
ListedPairDistances read_listed_distances(const std::string& file,
                                          std::span<const std::string> columns = {},
                                          const Control& control = {});

}  // namespace merl::pipeline
