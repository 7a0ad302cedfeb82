#include "app/cli/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <atomic>
#include <cstdio>

#include "app/cli/interrupt.h"

namespace merl::app {
namespace {

std::atomic<bool> is_shown = false;

}  // namespace

Progress::Progress(std::string title, bool quiet)
    : title_(std::move(title)), visible_(!quiet && ::isatty(STDERR_FILENO) != 0) {}

Progress::~Progress() {
    clear_progress();
}

void Progress::update(double share) {
    throw_if_interrupted();
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    if (!visible_ || seconds < 1 || share <= 0) {
        return;
    }
    is_shown = true;
    // Not fmt::print, which throws: a terminal that is gone does not stop the work.
    std::fputs(fmt::format("\r\x1b[K{}: {:.0f} %, about {:.0f} s left", title_, share * 100,
                           seconds / share * (1 - share))
                   .c_str(),
               stderr);
    std::fflush(stderr);
}

void clear_progress() {
    if (is_shown.exchange(false)) {
        std::fputs("\r\x1b[K", stderr);
    }
}

}  // namespace merl::app
