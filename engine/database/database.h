#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "engine/database/content_hash.h"
#include "engine/database/domain.h"

namespace merl::engine {

/// A contiguous range of voxels in file order, first included, last excluded.
struct VoxelRange {
    std::uint64_t first = 0;
    std::uint64_t last = 0;
    std::uint64_t size() const { return last - first; }
};

/// Above every physical reflectance (1/sr), and low enough that the float32 sums on the device,
/// which square it, cannot overflow.
constexpr double kMaxReflectance = 1e12;

/// A database of measured BRDFs on one grid, read a range of voxels at a time.
class Database {
  public:
    virtual ~Database() = default;

    const std::string& name() const { return name_; }
    const std::string& kind() const { return kind_; }  // "MERL directory" or "built-in stand-in"
    const Grid& grid() const { return grid_; }

    /// Names sorted bytewise, without extension; the order of everything else.
    const std::vector<std::string>& materials() const { return materials_; }

    /// Reflectance in 1/sr of one material: `samples` gets three planes (red, green, blue) of
    /// `range.size()` numbers each. Negative numbers mean "not measured" and come as they are; the
    /// others are finite and at most kMaxReflectance. With `hash`, what identifies these samples is
    /// added to it (ranges in order, see ContentHash). Any thread may call it.
    /// Throws Error (input) that names the file, the voxel and what was found.
    virtual void read(std::size_t material, VoxelRange range, std::span<double> samples,
                      ContentHash* hash = nullptr) const = 0;

  protected:
    Database(std::string name, std::string kind) : name_(std::move(name)), kind_(std::move(kind)) {}

    std::string name_;
    std::string kind_;
    Grid grid_;
    std::vector<std::string> materials_;
};

}  // namespace merl::engine
