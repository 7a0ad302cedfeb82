#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/domain.h"
#include "engine/distance/parts/pair_list.h"
#include "engine/distance/parts/slab.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// The visited voxels of a grid and what metrics know of them, for metrics that are to be computed
/// on it again and again: 88 MB of the grid of MERL.
struct KeptGeometry {
    explicit KeptGeometry(const Grid& grid);

    Domain domain;
    VoxelList list;
    std::vector<Slab> slabs;
};

/// Distances of single pairs under one metric of the library that is no summary, for programs that
/// ask again and again, such as an optimiser: voxels and weights are computed once. The same bits
/// as float64_distances().
class PairDistance {
  public:
    /// Throws std::invalid_argument for a metric of another kind, and InputError where the grid has
    /// no voxel in its window.
    PairDistance(Metric metric, std::shared_ptr<const KeptGeometry> geometry);

    /// On the threads of the caller's arena; any number of threads may call it at a time. Throws
    /// std::invalid_argument where the grid is another one, and what Database::read() throws.
    double operator()(const Database& database, MaterialPair pair) const;

  private:
    Metric metric_;
    std::shared_ptr<const KeptGeometry> geometry_;
    std::vector<BlockWeights> weights_;
};

}  // namespace merl::engine
