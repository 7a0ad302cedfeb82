#pragma once

#include <chrono>
#include <cstdint>
#include <string_view>

namespace merl::app {

/// Says on standard error what making distances exact will take, before and soon after it begins,
/// where that is long enough to matter.
class RefiningNotice {
  public:
    /// Each distance is a sum over so many voxels. Where not `advise`, no word of --fast.
    RefiningNotice(std::uint64_t voxels, bool advise) : voxels_(voxels), advise_(advise) {}

    /// So many distances of so many are about to be refined.
    void begin(std::uint64_t distances, std::uint64_t of);

    /// The share of a stage that is done.
    void update(std::string_view stage, double share);

  private:
    using Clock = std::chrono::steady_clock;

    std::uint64_t voxels_;
    bool advise_;
    bool estimated_ = true;  // or too little to estimate
    Clock::time_point start_;
};

}  // namespace merl::app
