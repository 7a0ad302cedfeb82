#include "app/commands/refining_notice.h"

#include <fmt/format.h>

#include <cstdio>
#include <string>

#include "app/cli/progress.h"

namespace merl::app {
namespace {

/// Terms of sums: fewer take a second or two, and that is not worth a line.
constexpr std::uint64_t kFew = 1'000'000'000;

/// Seconds of work from which an estimate is made, and seconds worth a line.
constexpr double kMeasured = 1;
constexpr double kLong = 10;

void say(const std::string& line) {
    clear_progress();
    // Not fmt::print, which throws: a terminal that is gone does not stop the work.
    std::fputs(("merl-scan: " + line + "\n").c_str(), stderr);
}

}  // namespace

void RefiningNotice::begin(std::uint64_t distances, std::uint64_t of) {
    start_ = Clock::now();
    estimated_ = distances < kFew / voxels_;
    if (!estimated_) {
        say(fmt::format("refining {} of {} distances in float64", fmt::group_digits(distances),
                        fmt::group_digits(of)));
    }
}

void RefiningNotice::update(std::string_view stage, double share) {
    const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
    if (estimated_ || stage != "refining" || share <= 0 || seconds < kMeasured) {
        return;
    }
    estimated_ = true;
    if (seconds / share >= kLong) {
        say(fmt::format("refining takes about {:.0f} s{}", seconds / share,
                        advise_ ? "; --fast refines only what the selection rests on, and gives "
                                  "the number of disagreements between bounds"
                                : ""));
    }
}

}  // namespace merl::app
