#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "engine/device/devices.h"
#include "engine/device/kernel.h"
#include "engine/device/submission.h"

namespace merl::device {

/// Cuts x × y workgroups into ranges of at most `most` (at least 1): rows, or where one row is more
/// than that, parts of one row.
std::vector<GroupRange> cut_groups(std::uint32_t x, std::uint32_t y, std::uint64_t most);

/// How much work may be handed to a device at once. What takes a GPU seconds, watchdogs end (2 s on
/// Windows, and likewise in drivers of Linux), and a desktop stands still meanwhile: it should be a
/// tenth of a second. A processor has no watchdog, and nothing is cut there.
class WorkBudget {
  public:
    static constexpr std::uint64_t kUnlimited = std::numeric_limits<std::uint64_t>::max();

    /// `operations` is what a unit of work takes, roughly, in float32 operations. The first budget
    /// is a guess that is safe on a slow device of this kind.
    WorkBudget(const DeviceInfo& device, double operations);

    /// The units that may go into one submit, at least 1.
    std::uint64_t units() const { return units_; }

    /// Learns from work that is finished; the budget grows at most fourfold. Without timestamps
    /// seconds are zero, and it stays as it is.
    void measured(double units, double seconds);

  private:
    std::uint64_t units_;
};

/// Records kernels so that no submit is more than the device's budget.
class PacedWork {
  public:
    explicit PacedWork(Submission& submission_) : submission(submission_) {}

    /// What a kernel does, in units of a budget.
    struct Share {
        double units_of_group = 0;
        const WorkBudget& budget;
        double& total;  // to which the units are added
    };

    /// A kernel that does not look at gl_NumWorkGroups, in as many ranges as it takes.
    void dispatch(const BoundKernel& kernel, std::span<const std::byte> push,
                  std::uint32_t groups_x, std::uint32_t groups_y, const Share& share);

    /// Any kernel, in one piece.
    void dispatch_whole(const BoundKernel& kernel, std::span<const std::byte> push,
                        std::uint32_t groups_x, std::uint32_t groups_y, const Share& share);

    Submission& submission;

  private:
    void record(const BoundKernel& kernel, std::span<const std::byte> push, const GroupRange& range,
                const Share& share);

    double filled_ = 0;  // share of one submit that the commands since the last split take
};

}  // namespace merl::device
