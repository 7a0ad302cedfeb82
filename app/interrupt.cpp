#include "app/interrupt.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <mutex>
#include <system_error>
#include <thread>

#include "app/exit_status.h"
#include "app/progress.h"

namespace merl::app {
namespace {

/// How long work may take to notice.
constexpr std::chrono::milliseconds kPatience{700};

volatile std::sig_atomic_t noted_signal = 0;
int wake_up = -1;  // the end of a pipe that the handler writes to

/// What to do with the files when work is ended.
struct Files {
    std::mutex mutex;
    std::filesystem::path unfinished;
    bool to_be_finished = false;
};

/// Never destroyed: the thread that watches outlives main().
Files& files() {
    static auto* const all = new Files;
    return *all;
}

void note_signal(int signal) {
    if (noted_signal != 0) {
        ::_exit(kInterrupted + signal);
    }
    noted_signal = signal;
    const int saved = errno;
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
    const std::scoped_lock lock(files().mutex);
    if (files().to_be_finished) {
        return;
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
    files().to_be_finished = true;
    files().unfinished.clear();
}

void say_interrupted() {
    static std::atomic_flag said;
    if (!said.test_and_set()) {
        clear_progress();
        std::fputs("merl-scan: interrupted; nothing was written\n", stderr);
    }
}

}  // namespace merl::app
