#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/distance/engines.h"
#include "engine/distance/parts/block_reader.h"
#include "engine/distance/parts/pair_list.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// Which distances to compute, over which voxels, and what it may take.
struct DistanceOptions {
    /// Bound on the memory of the device and on what the host takes: samples as read, grids, sums,
    /// totals. Not on the distances themselves, 16 bytes a pair and metric.
    std::uint64_t memory_bytes = 1ULL << 30U;
    VoxelSet voxels = VoxelSet::above_horizon;
    /// The only pairs to compute, first < second, ascending, each once; none are all pairs. Time
    /// and memory then grow with their number. Every material is read all the same, whether in a
    /// pair or not, because its hash and its counts are part of the result.
    std::span<const MaterialPair> pairs = {};
    /// The only pairs to compute, where no list is: each of the first so many materials with each
    /// of the others. 0 are all pairs.
    std::uint32_t rows = 0;
    /// Whether the database is a made-up one, on which a user's metric is tried: a window of a
    /// summary may then be empty, and its distances are 0.
    bool is_trial = false;
    /// Called after every slab with the share that is done, from 0 to 1, and with the same share
    /// again while a device is waited for. An exception thrown by it ends the computation and
    /// leaves through compute_distances().
    std::function<void(double)> progress = {};
};

/// What an engine has computed.
struct EngineUse {
    EngineDescription engine;
    std::vector<std::size_t> metrics;  // by their place in the list
    std::uint64_t peak_bytes = 0;      // of memory held for that
};

/// Distances, and what was learnt of the materials on the way.
struct DistanceResult {
    std::vector<MetricDistances> distances;  // per metric
    std::vector<EngineUse> engines;
    std::vector<MaterialCounts> counts;  // per material
    std::string content_hash;
    std::vector<std::string> plane_hashes;     // of each material (content_hash.h)
    std::vector<std::string> material_hashes;  // of each material's content, without its name
    std::vector<std::string> part_hashes;      // of each of Database::parts(), as by itself
    std::vector<std::string> warnings;         // one line each, for the user
    std::uint64_t voxels = 0;                  // visited
    std::uint64_t slabs = 0;                   // of all passes
    std::uint64_t passes = 1;                  // over rectangles of the matrix of all pairs
    DistanceSeconds seconds;
};

/// The distances of all pairs of a database, of those in a list or of a rectangle, under several
/// metrics. Each material is read once; but where the sums of all pairs do not fit into the memory,
/// it goes over squares of the matrix of all pairs (squares.h), and reads for each the materials of
/// its rows and columns.
///
/// The result does not depend on the slab size or the number of threads: sums run over fixed blocks
/// of kBlockVoxels voxels, and their float64 totals are added in the order of the voxels. Nor does
/// that of a pair depend on which others are computed. Throws std::invalid_argument for a list that
/// is not as it should be, InputError where a material is not the same when it is read again.
DistanceResult compute_distances(Engines& engines, const Database& database,
                                 std::span<const Metric* const> metrics,
                                 const DistanceOptions& options = {});

}  // namespace merl::engine
