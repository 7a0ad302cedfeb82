#include "app/cli/guard.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <spawn.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>
#include <fstream>
#include <limits>
#include <new>
#include <string_view>
#include <system_error>
#include <vector>

#include "app/cli/interrupt.h"
#include "engine/base/error.h"

namespace merl::app {
namespace {

constexpr int kLookEvery = 50;  // milliseconds

/// In the place of the digit of a fault: what follows is the result.
constexpr char kResult = '=';

/// What the child reports: the result, or the fault and the message.
std::string report_of(const std::function<std::string()>& work) {
    const auto report = [](Fault fault, const char* message) {
        return static_cast<char>('0' + static_cast<int>(fault)) + std::string(message);
    };
    try {
        return kResult + work();
    } catch (const Error& error) {
        return report(error.fault(), error.what());
    } catch (const std::bad_alloc&) {
        return report(Fault::resource,
                      "out of memory; raise the limit (ulimit -v, the container's)");
    } catch (const std::exception& error) {
        return report(Fault::input, error.what());
    }
}

void write_report(int to_parent, const std::function<std::string()>& work) {
    std::string report = report_of(work);
    report += '.';  // says that it got this far
    const char* rest = report.data();
    const char* const end = rest + report.size();
    while (rest < end) {
        const auto written = ::write(to_parent, rest, static_cast<std::size_t>(end - rest));
        if (written <= 0) {
            break;
        }
        rest += written;
    }
}

std::uint64_t resident_bytes(pid_t child) {
    std::ifstream statm(fmt::format("/proc/{}/statm", child));
    std::uint64_t size = 0;
    std::uint64_t resident = 0;
    statm >> size >> resident;
    return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// The child; at the end it is gone, whatever happens.
class Child {
  public:
    Child(pid_t child, int from_child) : child_(child), from_child_(from_child) {}
    ~Child() {
        ::kill(child_, SIGKILL);
        ::waitpid(child_, nullptr, 0);
        ::close(from_child_);
    }

    /// After it said nothing: whether somebody ended it, the system for want of memory for one,
    /// which says nothing of what it did. Waits for its end.
    bool was_killed() const {
        siginfo_t end = {};
        return ::waitid(P_PID, static_cast<id_t>(child_), &end, WEXITED | WNOWAIT) == 0 &&
               end.si_code == CLD_KILLED &&
               (end.si_status == SIGKILL || end.si_status == SIGTERM || end.si_status == SIGXCPU);
    }
    Child(const Child&) = delete;
    Child& operator=(const Child&) = delete;

    /// All that it writes until it ends; "" when it says nothing.
    std::string listen(const std::string& what, double seconds, std::uint64_t bytes) const {
        using Clock = std::chrono::steady_clock;
        const auto end = Clock::now() + std::chrono::duration<double>(seconds);
        std::string report;
        std::array<char, 4096> buffer = {};
        for (;;) {
            throw_if_interrupted();
            pollfd wait = {.fd = from_child_, .events = POLLIN, .revents = 0};
            if (::poll(&wait, 1, kLookEvery) > 0) {
                const auto count = ::read(from_child_, buffer.data(), buffer.size());
                if (count <= 0) {
                    return report;
                }
                report.append(buffer.data(), static_cast<std::size_t>(count));
            }
            if (Clock::now() > end) {
                throw InputError(
                    fmt::format("{} took more than {} seconds: it is too "
                                "large, or has no end",
                                what, seconds));
            }
            if (resident_bytes(child_) > bytes) {
                throw InputError(fmt::format("{} took more than {} MiB of memory: it is too large",
                                             what, bytes >> 20U));
            }
        }
    }

  private:
    pid_t child_;
    int from_child_;
};

struct Pipe {
    int out = -1;
    int in = -1;
};

Pipe make_pipe() {
    std::array<int, 2> ends = {};
    if (::pipe2(ends.data(), O_CLOEXEC) != 0) {
        throw std::system_error(errno, std::generic_category(), "no pipe");
    }
    return {.out = ends[0], .in = ends[1]};
}

/// What a child says, once it has ended or is too much.
std::string result_of(const Child& child, const std::string& what, double seconds,
                      std::uint64_t bytes) {
    const auto report = child.listen(what, seconds, bytes);
    if (report.size() < 2) {  // not even its end
        if (child.was_killed()) {
            throw Error(Fault::resource, fmt::format("{} was killed", what));
        }
        throw InputError(fmt::format("{} makes the compiler or the driver crash", what));
    }
    auto text = report.substr(1, report.size() - 2);
    if (report[0] != kResult) {
        throw Error(static_cast<Fault>(report[0] - '0'), text);
    }
    return text;
}

/// The environment of this process with some variables changed.
std::vector<std::string> environment_with(const Variables& variables) {
    std::vector<std::string> environment;
    for (char** setting = environ; *setting != nullptr; ++setting) {
        const std::string_view text = *setting;
        if (!variables.contains(std::string(text.substr(0, text.find('='))))) {
            environment.emplace_back(text);
        }
    }
    for (const auto& [name, value] : variables) {
        if (value) {
            environment.push_back(fmt::format("{}={}", name, *value));
        }
    }
    return environment;
}

/// As system calls take them.
std::vector<char*> pointers(std::vector<std::string>& texts) {
    std::vector<char*> result;
    result.reserve(texts.size() + 1);
    for (auto& text : texts) {
        result.push_back(text.data());
    }
    result.push_back(nullptr);
    return result;
}

}  // namespace

void run_guarded(const std::string& what, double seconds, std::uint64_t bytes,
                 const std::function<void()>& work) {
    const Pipe pipe = make_pipe();
    std::fflush(nullptr);
    const pid_t id = ::fork();
    if (id < 0) {
        throw std::system_error(errno, std::generic_category(), "no process");
    }
    if (id == 0) {
        ::prctl(PR_SET_PDEATHSIG, SIGKILL);
        write_report(pipe.in, [&] {
            work();
            return std::string();
        });
        ::_exit(0);
    }
    ::close(pipe.in);
    result_of(Child(id, pipe.out), what, seconds, bytes);
}

std::string ask_guarded(const std::string& what, double seconds, std::uint64_t bytes,
                        const std::vector<std::string>& arguments, const Variables& variables) {
    std::vector<std::string> words = {"merl-scan", kGuarded, "--"};
    words.insert(words.end(), arguments.begin(), arguments.end());
    auto environment = environment_with(variables);
    const Pipe pipe = make_pipe();
    posix_spawn_file_actions_t actions;
    ::posix_spawn_file_actions_init(&actions);
    ::posix_spawn_file_actions_adddup2(&actions, pipe.in, STDOUT_FILENO);
    pid_t id = 0;
    const int error = ::posix_spawn(&id, "/proc/self/exe", &actions, nullptr,
                                    pointers(words).data(), pointers(environment).data());
    ::posix_spawn_file_actions_destroy(&actions);
    ::close(pipe.in);
    if (error != 0) {
        ::close(pipe.out);
        throw std::system_error(error, std::generic_category(), "no process");
    }
    return result_of(Child(id, pipe.out), what, seconds, bytes);
}

void set_variables(const Variables& variables) {
    for (const auto& [name, value] : variables) {
        if (value) {
            ::setenv(name.c_str(), value->c_str(), /*overwrite=*/1);
        } else {
            ::unsetenv(name.c_str());
        }
    }
}

void answer(const std::function<std::string()>& work) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    // The parent hears what is meant for both, and ends this process.
    std::signal(SIGINT, SIG_IGN);
    std::signal(SIGHUP, SIG_IGN);
    write_report(STDOUT_FILENO, work);
}

void with_little_stack(const std::function<void()>& work) {
    constexpr std::size_t kBytes = std::size_t{2} << 20U;
    const tbb::global_control workers(tbb::global_control::thread_stack_size, kBytes);
    pthread_attr_t attributes;
    ::pthread_attr_init(&attributes);
    ::pthread_attr_setstacksize(&attributes, kBytes);
    struct Call {
        const std::function<void()>& work;
        std::exception_ptr thrown = nullptr;
    } call = {work};
    const auto run = [](void* argument) -> void* {
        auto& asked = *static_cast<Call*>(argument);
        try {
            asked.work();
        } catch (...) {
            asked.thrown = std::current_exception();
        }
        return nullptr;
    };
    pthread_t thread = {};
    const int error = ::pthread_create(&thread, &attributes, run, &call);
    ::pthread_attr_destroy(&attributes);
    if (error != 0) {
        throw Error(Fault::resource, fmt::format("no thread: {}", std::strerror(error)));
    }
    ::pthread_join(thread, nullptr);
    if (call.thrown) {
        std::rethrow_exception(call.thrown);
    }
}

bool memory_is_limited() {
    const auto is_limited = [](auto resource) {
        rlimit limit = {};
        return ::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
    };
    return is_limited(RLIMIT_AS) || is_limited(RLIMIT_DATA);
}

std::string with_advice(const device::NoDriverError& error) {
    return error.is_installed() ? error.what()
                                : fmt::format(
                                      "{}; on Debian: apt-get install libvulkan1 "
                                      "mesa-vulkan-drivers (lavapipe runs on any processor)",
                                      error.what());
}

std::string with_advice(const device::DeviceLostError& error) {
    return fmt::format(
        "{}; `merl-scan devices` lists what else can compute, and --device host needs none of it",
        error.what());
}

}  // namespace merl::app
