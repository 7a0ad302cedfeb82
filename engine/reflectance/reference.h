#pragma once

#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "engine/reflectance/database.h"
#include "engine/reflectance/domain.h"
#include "engine/reflectance/metric.h"

namespace merl::reflectance {

using MaterialPair = std::pair<std::uint32_t, std::uint32_t>;

/// E of SPEC equation 4.20 for some pairs of materials, in float64 on the CPU, from the metric's
/// own file and the database's float64 samples (negative numbers count as zero). Deterministic:
/// sums run over blocks of kBlockVoxels voxels, then over blocks, whatever the number of threads.
std::vector<double> reference_distances(const Database& database, const Metric& metric,
                                        std::span<const MaterialPair> pairs,
                                        VoxelSet set = VoxelSet::above_horizon);

}  // namespace merl::reflectance
