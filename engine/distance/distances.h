#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/device/context.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/distance/parts/slab_plan.h"
#include "engine/distance/parts/slab_reader.h"
#include "engine/metric/metric.h"

namespace merl::engine {

struct DistanceOptions {
    /// Bound on the memory of the device and on what the host takes: samples as read, grids, sums,
    /// totals. Not on the distances themselves, 16 bytes a pair and metric.
    std::uint64_t memory_bytes = 1ULL << 30U;
    VoxelSet voxels = VoxelSet::above_horizon;
    bool shaders_only = false;  // no metric is SlabPlan::on_host(): for tests and benchmarks
    /// Called after every slab with the share that is done, from 0 to 1. An exception thrown by it
    /// ends the computation and leaves through compute_distances().
    std::function<void(double)> progress = {};
};

/// Seconds spent in the parts of compute_distances(); reading and a device's work overlap.
struct DistanceSeconds {
    double kernels = 0;     // compiling the kernels and making the buffers
    double reading = 0;     // host: reading, converting, hashing, grids of metrics with a twin
    double transform = 0;   // device: grids of the others; norms
    double difference = 0;  // device or host: grids to partial sums
    double waiting = 0;     // host: waiting for the device
    double adding = 0;      // host: adding partial sums in float64
    double total = 0;       // from start to end
};

struct DistanceResult {
    std::vector<MetricDistances> distances;  // per metric
    std::vector<MaterialCounts> counts;      // per material
    std::string content_hash;
    std::vector<std::string> material_hashes;  // of each material's content, without its name
    std::vector<std::string> warnings;         // one line each, for the user
    std::uint64_t voxels = 0;                  // visited
    SlabPlan plan;                             // says which metrics were on_host()
    std::uint64_t host_bytes = 0;              // held for those
    DistanceSeconds seconds;
};

/// All pair distances of a database under several metrics, each material read once.
///
/// The result does not depend on the slab size or the number of threads: float32 sums run over
/// fixed blocks of kBlockVoxels voxels, and their float64 totals are added in the order of the
/// voxels.
DistanceResult compute_distances(device::Context& context, const Database& database,
                                 std::span<const Metric* const> metrics,
                                 const DistanceOptions& options = {});

}  // namespace merl::engine
