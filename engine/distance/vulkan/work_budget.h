#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "engine/device/devices.h"
#include "engine/device/submission.h"

namespace merl::engine {

/// Cuts x × y workgroups into ranges of at most `most` (at least 1): rows, or where one row is more
/// than that, parts of one row.
std::vector<device::GroupRange> cut_groups(std::uint32_t x, std::uint32_t y, std::uint64_t most);

/// How much work may be handed to a device at once. What takes a GPU seconds, watchdogs end (2 s on
/// Windows, and likewise in drivers of Linux), and a desktop stands still meanwhile: it should be a
/// tenth of a second. A processor has no watchdog, and nothing is cut there.
class WorkBudget {
  public:
    static constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

    /// `operations` is what a unit of work takes, roughly, in float32 operations. The first budget
    /// is a guess that is safe on a slow device of this kind.
    WorkBudget(const device::DeviceInfo& device, double operations);

    /// The units that may go into one submit, at least 1.
    std::uint64_t units() const { return units_; }

    /// Learns from work that is finished; the budget grows at most fourfold. Without timestamps
    /// seconds are zero, and it stays as it is.
    void measured(double units, double seconds);

  private:
    std::uint64_t units_;
};

}  // namespace merl::engine
