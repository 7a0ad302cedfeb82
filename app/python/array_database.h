#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::python {

/// Samples of one material somewhere in memory, theta_h x theta_d x phi_d x channel.
struct SampleArray {
    const std::byte* data = nullptr;
    std::array<std::ptrdiff_t, 4> strides = {};  // in bytes, of any sign
    bool is_float32 = false;
    std::shared_ptr<const void> owner = {};  // keeps the memory
};

/// Materials in arrays of another program's, in 1/sr, which are read where they are. NaN and what
/// is negative was not measured. Their content is that of the same float64 samples, with -1 for
/// all that was not measured. Reading throws InputError for what is infinite or above
/// kMaxReflectance.
class ArrayDatabase final : public engine::Database {
  public:
    /// Materials by their names, ascending. Throws what require_usable() throws.
    ArrayDatabase(std::string name, const engine::Grid& grid, std::vector<std::string> materials,
                  std::vector<SampleArray> samples);

    void read(std::size_t material, engine::VoxelRange range, std::span<double> samples,
              const engine::SampleSink& sink = {}) const override;

  private:
    std::vector<SampleArray> samples_;
};

}  // namespace merl::python
