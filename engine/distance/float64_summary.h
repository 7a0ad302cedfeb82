#pragma once

#include <vector>

#include "engine/database/database.h"
#include "engine/distance/float64_distances.h"

namespace merl::engine {

/// The distances of some pairs under a summary metric with a twin, by plain sums over the voxels in
/// their order, in long double: what tests and `verify` hold engines to, which nothing else needs.
std::vector<double> float64_summary_distances(const Database& database,
                                              const Float64Request& request, VoxelSet set);

}  // namespace merl::engine
