#include "app/cli/interrupt.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <limits>
#include <mutex>
#include <string_view>
#include <system_error>
#include <thread>

#include "app/cli/exit_status.h"
#include "app/cli/progress.h"

namespace merl::app {
namespace {

/// How long work may take to notice.
constexpr std::chrono::milliseconds kPatience{700};

/// Signals that come so soon after the first are the same request.
constexpr std::int64_t kSameMilliseconds = 200;

// What the handler and the thread that watches share with the work.
std::atomic<int> noted_signal = 0;
std::atomic<std::int64_t> noted_at = std::numeric_limits<std::int64_t>::max();
std::atomic<int> finishing = 0;  // what only a second signal ends
static_assert(std::atomic<int>::is_always_lock_free &&
              std::atomic<std::int64_t>::is_always_lock_free);
std::atomic<const char*> outcome = "nothing was written";
int wake_up = -1;  // the end of a pipe that the handler writes to

/// What to remove when work is ended.
struct Files {
    std::mutex mutex;
    std::filesystem::path unfinished;
};

/// Never destroyed: the thread that watches outlives main().
Files& files() {
    static auto* const all = new Files;
    return *all;
}

std::int64_t milliseconds() {
    timespec now = {};
    ::clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1000 + now.tv_nsec / 1'000'000;
}

void end_at_once(int signal) {
    if (finishing > 0) {
        constexpr std::string_view kWord =
            "merl-scan: ended while results went into place; the next run into the same directory "
            "finishes that\n";
        [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kWord.data(), kWord.size());
    }
    ::_exit(kInterrupted + signal);
}

void note_signal(int signal) {
    const int saved = errno;
    int none = 0;
    if (!noted_signal.compare_exchange_strong(none, signal)) {
        if (milliseconds() - noted_at > kSameMilliseconds) {
            end_at_once(signal);
        }
        errno = saved;
        return;
    }
    noted_at = milliseconds();
    const char byte = 0;
    [[maybe_unused]] const auto written = ::write(wake_up, &byte, 1);
    errno = saved;
}

/// Waits for a signal, and ends the program if it has not ended by itself soon after.
void watch(int woken) {
    char byte = 0;
    // A child that was forked writes to the same pipe; its signals are not ours.
    while (noted_signal == 0) {
        if (::read(woken, &byte, 1) <= 0 && errno != EINTR) {
            return;
        }
    }
    std::this_thread::sleep_for(kPatience);
    std::unique_lock lock(files().mutex);
    while (finishing > 0) {
        lock.unlock();
        std::this_thread::sleep_for(kPatience);
        lock.lock();
    }
    std::error_code ignored;
    if (!files().unfinished.empty()) {
        std::filesystem::remove_all(files().unfinished, ignored);
    }
    say_interrupted();
    ::_exit(kInterrupted + noted_signal);
}

}  // namespace

void catch_interrupts() {
    std::array<int, 2> ends = {-1, -1};
    if (::pipe2(ends.data(), O_CLOEXEC) == 0) {
        wake_up = ends[1];
        try {
            std::thread(watch, ends[0]).detach();
        } catch (const std::system_error&) {
            // Without a thread, work has to notice by itself.
        }
    }
    std::signal(SIGINT, note_signal);
    std::signal(SIGTERM, note_signal);
    std::signal(SIGUSR1, note_signal);
    if (std::signal(SIGHUP, note_signal) == SIG_IGN) {
        std::signal(SIGHUP, SIG_IGN);  // nohup
    }
    std::signal(SIGPIPE, SIG_IGN);
    std::signal(SIGXFSZ, SIG_IGN);
}

void throw_if_interrupted() {
    if (noted_signal != 0) {
        throw Interrupted(noted_signal);
    }
}

void set_unfinished(const std::filesystem::path& directory) {
    const std::scoped_lock lock(files().mutex);
    files().unfinished = directory;
}

void finish_in_any_case() {
    const std::scoped_lock lock(files().mutex);
    ++finishing;
    files().unfinished.clear();
}

Finishing::Finishing() {
    const std::scoped_lock lock(files().mutex);
    ++finishing;
}

Finishing::~Finishing() {
    --finishing;
}

void say_when_interrupted(const char* what) {
    outcome = what;
}

void say_interrupted() {
    static std::atomic_flag said;
    if (!said.test_and_set()) {
        clear_progress();
        std::fprintf(stderr, "merl-scan: interrupted; %s\n", outcome.load());
    }
}

}  // namespace merl::app
