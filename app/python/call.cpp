#include "app/python/call.h"

#include <fmt/format.h>
#include <tbb/info.h>
#include <tbb/task_arena.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <exception>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "app/python/text.h"
#include "app/python/unlocked.h"
#include "engine/base/error.h"

namespace py = pybind11;

namespace merl::python {
namespace {

constexpr auto kBetweenLooks = std::chrono::milliseconds(50);

/// The process that has computed something; 0: none has.
std::atomic<pid_t> computing_process = 0;

/// How many Unlocked there are; and whether Python ends.
std::atomic<int> unlocked_calls = 0;
std::atomic<bool> is_ending = false;

void require_not_ending() {
    if (is_ending) {
        const py::gil_scoped_acquire locked;
        PyErr_SetNone(PyExc_SystemExit);  // which ends a thread without a word
        throw py::error_already_set();
    }
}

void require_not_forked() {
    pid_t none = 0;
    if (!computing_process.compare_exchange_strong(none, ::getpid()) && none != ::getpid()) {
        throw Error(Fault::resource,
                    fmt::format("process {} was forked from one in which merl_scan had computed "
                                "already, whose threads it does not have; fork before the first "
                                "call, or begin processes anew "
                                "(multiprocessing.get_context(\"spawn\"))",
                                ::getpid()));
    }
}

struct Idle {
    std::mutex mutex;
    std::multimap<std::string, std::unique_ptr<engine::Engines>> engines;  // by device
};

/// Never destroyed: drivers do not survive being closed while a process ends.
Idle& idle() {
    static auto* const one = new Idle;
    return *one;
}

}  // namespace

Unlocked::Unlocked() {
    ++unlocked_calls;
    state_ = PyEval_SaveThread();
}

Unlocked::~Unlocked() {
    PyEval_RestoreThread(state_);
    --unlocked_calls;
}

void end_calls() {
    is_ending = true;
    const pid_t computing = computing_process;
    if (computing != 0 && computing != ::getpid()) {
        return;  // the threads that are counted are those of the process from which it was forked
    }
    const py::gil_scoped_release unlocked;
    while (unlocked_calls > 0) {
        std::this_thread::sleep_for(kBetweenLooks / 10);
    }
}

CallOptions call_options(const py::dict& options) {
    CallOptions result;
    result.device = from_python(options["device"]);
    result.progress = options["progress"];
    const auto memory = options["memory"].cast<double>();
    if (!(memory >= 1) || memory > 0x1p62) {
        throw Error(Fault::usage,
                    fmt::format("memory: found {} bytes; expected 1 or more", memory));
    }
    result.memory_bytes = options["memory"].cast<std::uint64_t>();
    constexpr int kMost = 4096;
    result.threads = options["threads"].cast<int>();
    if (result.threads < 0 || result.threads > kMost) {
        throw Error(Fault::usage, fmt::format("threads: found {}; expected 1 to {}, or 0 for all",
                                              result.threads, kMost));
    }
    return result;
}

void run(const CallOptions& options, const std::function<void(const pipeline::Control&)>& work) {
    require_not_ending();
    require_not_forked();
    auto last = std::chrono::steady_clock::now();
    const pipeline::Control control = {.progress = [&](std::string_view stage, double share) {
        require_not_ending();
        const auto now = std::chrono::steady_clock::now();
        if (now - last < kBetweenLooks && share < 1) {
            return;
        }
        last = now;
        const py::gil_scoped_acquire locked;
        if (PyErr_CheckSignals() != 0) {
            throw py::error_already_set();
        }
        if (!options.progress.is_none()) {
            options.progress(to_python(stage), share);
        }
    }};
    const Unlocked unlocked;
    if (options.threads == 0) {
        work(control);
    } else {
        // More than there are change nothing, and TBB would print a warning.
        tbb::task_arena arena(std::min(options.threads, tbb::info::default_concurrency()));
        arena.execute([&] { work(control); });
    }
}

BorrowedEngines::BorrowedEngines(const std::string& device)
    : device_(device), exceptions_(std::uncaught_exceptions()) {
    const std::lock_guard lock(idle().mutex);
    const auto found = idle().engines.find(device);
    if (found != idle().engines.end()) {
        engines_ = std::move(found->second);
        idle().engines.erase(found);
    } else {
        engines_ = std::make_unique<engine::Engines>(device::ContextOptions{.device = device});
    }
}

BorrowedEngines::~BorrowedEngines() {
    if (std::uncaught_exceptions() == exceptions_) {
        const std::lock_guard lock(idle().mutex);
        idle().engines.emplace(device_, std::move(engines_));
    }
}

}  // namespace merl::python
