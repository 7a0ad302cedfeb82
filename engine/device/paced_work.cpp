#include "engine/device/paced_work.h"

#include <algorithm>

namespace merl::device {
namespace {

constexpr double kSeconds = 0.1;

/// Of float32 a second. An integrated GPU of 200 GFLOPS, of which a kernel gets a twentieth where
/// its registers do not suffice or it waits for memory; a small card is some four times as fast.
constexpr double kSlowOperations = 200e9 / 20;
constexpr double kSlowOperationsOfACard = 4 * kSlowOperations;

/// At least one, and never so much that it means no limit.
std::uint64_t whole_units(double units) {
    return static_cast<std::uint64_t>(std::clamp(units, 1.0, 1e18));
}

}  // namespace

std::vector<GroupRange> cut_groups(std::uint32_t x, std::uint32_t y, std::uint64_t most) {
    const auto width = static_cast<std::uint32_t>(std::min<std::uint64_t>(x, most));
    const auto height = static_cast<std::uint32_t>(
        std::clamp<std::uint64_t>(most / x, 1, y));  // 1 where a row is cut
    std::vector<GroupRange> ranges;
    for (std::uint32_t row = 0; row < y; row += height) {
        for (std::uint32_t column = 0; column < x; column += width) {
            ranges.push_back({.first_x = column,
                              .first_y = row,
                              .groups_x = std::min(width, x - column),
                              .groups_y = std::min(height, y - row)});
        }
    }
    return ranges;
}

WorkBudget::WorkBudget(const DeviceInfo& device, double operations)
    : units_(device.limits.is_host
                 ? kUnlimited
                 : whole_units(
                       (device.kind == "discrete GPU" ? kSlowOperationsOfACard : kSlowOperations) *
                       kSeconds / operations)) {}

void WorkBudget::measured(double units, double seconds) {
    if (units_ != kUnlimited && seconds > 0) {
        units_ = whole_units(std::min(units * kSeconds / seconds, 4 * static_cast<double>(units_)));
    }
}

void PacedWork::record(const BoundKernel& kernel, std::span<const std::byte> push,
                       const GroupRange& range, const Share& share) {
    const double units =
        share.units_of_group * static_cast<double>(range.groups_x) * range.groups_y;
    const double filling = units / static_cast<double>(share.budget.units());
    if (filled_ > 0 && filled_ + filling > 1) {
        submission.split();
        filled_ = 0;
    }
    submission.dispatch(kernel, push, range);
    filled_ += filling;
    share.total += units;
}

void PacedWork::dispatch(const BoundKernel& kernel, std::span<const std::byte> push,
                         std::uint32_t groups_x, std::uint32_t groups_y, const Share& share) {
    const double most = static_cast<double>(share.budget.units()) / share.units_of_group;
    const auto limit =
        static_cast<std::uint64_t>(std::clamp(most, 1.0, static_cast<double>(groups_x) * groups_y));
    for (const auto& range : cut_groups(groups_x, groups_y, limit)) {
        record(kernel, push, range, share);
    }
}

void PacedWork::dispatch_whole(const BoundKernel& kernel, std::span<const std::byte> push,
                               std::uint32_t groups_x, std::uint32_t groups_y, const Share& share) {
    record(kernel, push, {.groups_x = groups_x, .groups_y = groups_y}, share);
}

}  // namespace merl::device
