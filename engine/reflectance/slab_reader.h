#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/reflectance/content_hash.h"
#include "engine/reflectance/database.h"
#include "engine/reflectance/domain.h"

namespace merl::reflectance {

/// What reading a whole database found in one material.
struct MaterialCounts {
    std::uint64_t negative = 0;                // samples with at least one negative channel
    std::uint64_t negative_above_horizon = 0;  // of them, where a metric would have seen them
};

/// Numbers of one voxel in the geometry of a slab, in the order of Voxel.
constexpr std::size_t kGeometryNumbers = 8;

/// Reads a database slab by slab, in order, for the device.
class SlabReader {
  public:
    SlabReader(const Database& database, const Domain& domain, const VoxelList& voxels);

    /// Fills `samples` with the visited voxels at positions [first, last) of all materials, as
    /// [material][channel][stride]; negative numbers become zero. Fills `geometry` with
    /// kGeometryNumbers a voxel. What lies beyond the last voxel is left as it is.
    /// Slabs must come in order and without gaps; several threads share the work of one.
    void read(std::uint64_t first, std::uint64_t last, std::span<double> samples,
              std::uint64_t stride, std::span<double> geometry);

    /// After the last slab.
    const std::vector<MaterialCounts>& counts() const { return counts_; }
    std::string content_hash() const;

  private:
    void read_material(std::size_t material, VoxelRange file, std::span<const VoxelRun> runs,
                       std::uint64_t first, std::span<double> samples, std::uint64_t stride);

    const Database& database_;
    const Domain& domain_;
    const VoxelList& voxels_;
    std::vector<MaterialCounts> counts_;
    ContentHash hash_;
    std::uint64_t file_position_ = 0;  // voxels of each file read so far
};

}  // namespace merl::reflectance
