#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "engine/device/buffer.h"
#include "engine/device/context.h"
#include "engine/device/kernel.h"

namespace merl::device {

/// Some of the workgroups of a dispatch.
struct GroupRange {
    std::uint32_t first_x = 0;
    std::uint32_t first_y = 0;
    std::uint32_t groups_x = 0;
    std::uint32_t groups_y = 0;
};

/// A list of device commands, recorded once and submitted as often as wanted.
///
/// Commands run in order: each sees all that the ones before it wrote. After wait() the host sees
/// every buffer that was downloaded.
class Submission {
  public:
    /// `most_marks` is how often mark() may be called.
    explicit Submission(Context& context, std::uint32_t most_marks = 2);
    /// Waits for work that is still running, but not for ever: a device that has not ended after
    /// ten seconds is left alone.
    ~Submission();
    Submission(Submission&&) noexcept;
    Submission& operator=(Submission&&) noexcept;

    /// Starts recording anew; whatever was recorded is forgotten. Not while running.
    void begin();

    /// Makes the first `bytes` of the host's view of `buffer` visible to the commands after it.
    /// Call it before those, and for a buffer that no other submission in flight uses: where the
    /// device has a queue that only copies, the copy is made while earlier submissions still
    /// compute.
    void upload(const Buffer& buffer, std::uint64_t bytes);

    /// Runs groups_x × groups_y workgroups. Throws std::logic_error beyond the device's limits.
    void dispatch(const BoundKernel& kernel, std::span<const std::byte> push,
                  std::uint32_t groups_x, std::uint32_t groups_y);

    /// Runs a range of them; gl_WorkGroupID and gl_GlobalInvocationID are as in the whole, but
    /// gl_NumWorkGroups is that of the range.
    void dispatch(const BoundKernel& kernel, std::span<const std::byte> push,
                  const GroupRange& range);

    /// What is recorded from here on is handed to the device apart, after what was before. The
    /// order of commands stays; a watchdog sees several pieces of work instead of one.
    void split();

    /// Makes the first `bytes` of `buffer` visible in its host view once wait() returns.
    void download(const Buffer& buffer, std::uint64_t bytes);

    /// A point in time: seconds() gives the time between each mark and the next. Throws
    /// std::logic_error when there are too many.
    void mark();

    void submit();

    /// Waits for the work to end, however long that takes, and calls `meanwhile` about ten times a
    /// second until then; what it throws ends the waiting, not the work. Throws Error (device) when
    /// the device is lost. Does nothing when nothing was submitted.
    void wait(const std::function<void()>& meanwhile = {});

    /// Device seconds between successive marks of the finished work; zeros without timestamps.
    std::vector<double> seconds() const;

  private:
    struct Handles;
    std::unique_ptr<Handles> handles_;
};

}  // namespace merl::device
