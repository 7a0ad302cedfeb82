#pragma once

#include <functional>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// A database whose samples are in memory: of made-up materials, or of another program's. A class
/// for a file whose samples fit in memory may derive from it, and then sets kind_ and path_.
class MemoryDatabase : public Database {
  public:
    /// `samples[m]` has the three planes of material m, one after the other, in 1/sr; what is
    /// negative was not measured. Throws what require_usable() throws, and InputError when there
    /// are not as many numbers as the grid needs, or one is not finite or above kMaxReflectance.
    MemoryDatabase(std::string name, const Grid& grid, std::vector<std::string> materials,
                   std::vector<std::vector<double>> samples);

    /// The same from a function of material, file index of the voxel, and channel.
    using Sample =
        std::function<double(std::size_t material, std::uint64_t voxel, std::size_t channel)>;
    MemoryDatabase(std::string name, const Grid& grid, std::vector<std::string> materials,
                   const Sample& sample);

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink = {}) const override;

  private:
    std::vector<std::vector<double>> samples_;
};

}  // namespace merl::engine
