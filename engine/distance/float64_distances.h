#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/distance/parts/pair_list.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// Some pairs of materials under one metric, which has a twin and is no summary if there are any.
struct Float64Request {
    const Metric* metric;
    std::vector<MaterialPair> pairs;
    /// A power of two that transformed samples are multiplied with, and the distances divided by.
    /// Only for a metric with a degree.
    double scale = 1;
};

/// E of Ryman 2018, equation 4.20, for each request and pair, in float64 on the CPU, from the
/// metric's own file and the database's float64 samples (negative numbers count as zero): within
/// 1e-14 of itself under a metric with a degree (docs/numerics.md). Where a sum falls below the
/// range of float64, as squares of differences below 1e-154 do, it is computed again with scaled
/// samples. The same bits on every processor, whatever the number of threads, whichever other pairs
/// are asked for, in whichever order the two materials are, and however little memory there is.
/// `progress` is called between pieces of work with the share done and may throw.
///
/// Transformed samples stay within `memory_bytes`, but those of two materials, and of what each
/// thread reads, a quarter of a MiB, are always there; beside them each pair takes 48 bytes. Every
/// material is read once where all have room, otherwise once with every group of others.
std::vector<std::vector<double>> float64_distances(const Database& database,
                                                   std::span<const Float64Request> requests,
                                                   VoxelSet set = VoxelSet::above_horizon,
                                                   const std::function<void(double)>& progress = {},
                                                   std::uint64_t memory_bytes = 1ULL << 30U);

/// The same for a single metric, which may be a summary (float64_summary.h).
std::vector<double> float64_distances(const Database& database, const Metric& metric,
                                      std::span<const MaterialPair> pairs,
                                      VoxelSet set = VoxelSet::above_horizon);

}  // namespace merl::engine
