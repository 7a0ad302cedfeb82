#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/device/context.h"
#include "engine/reflectance/database.h"
#include "engine/reflectance/metric.h"
#include "engine/reflectance/slab_plan.h"
#include "engine/reflectance/slab_reader.h"

namespace merl::reflectance {

struct DistanceOptions {
    std::uint64_t memory_bytes = 1ULL << 30U;  // bound on device memory
    VoxelSet voxels = VoxelSet::above_horizon;
    /// Called after every slab with the share that is done, from 0 to 1. An exception thrown by it
    /// ends the computation and leaves through compute_distances().
    std::function<void(double)> progress = {};
};

/// Seconds spent in the parts of compute_distances(); reading and computing overlap.
struct DistanceSeconds {
    double kernels = 0;     // compiling the kernels and making the buffers
    double reading = 0;     // host: reading, converting, hashing, grids of metrics with a twin
    double transform = 0;   // device: grids of the others; norms
    double difference = 0;  // device: grids to partial sums
    double waiting = 0;     // host: waiting for the device
    double adding = 0;      // host: adding partial sums in float64
    double total = 0;       // from start to end
};

/// E of SPEC equation 4.20 for each pair (0,1), (0,2) … (1,2) … of materials under one metric.
struct MetricDistances {
    std::vector<double> values;
    /// How far each can be from the exact value (error_bound.h); infinite where no bound is known.
    std::vector<double> bounds;

    bool operator==(const MetricDistances&) const = default;
};

struct DistanceResult {
    std::vector<MetricDistances> distances;  // per metric
    std::vector<MaterialCounts> counts;      // per material
    std::string content_hash;
    std::uint64_t voxels = 0;  // visited
    SlabPlan plan;
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

}  // namespace merl::reflectance
