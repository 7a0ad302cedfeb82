// Loaded before the program (LD_PRELOAD): makes one of its system calls fail, or kills or stops it
// there.
//
//     MERL_SCAN_FAULT=CALL:N:ERROR[:PART]     CALL may be "any"; "N+": that one and all after it
//     MERL_SCAN_FAULT=thread:N:ERROR          threads cannot be started; "any" does not count them
//     MERL_SCAN_FAULT_LOG=FILE                gets a line for each call that was struck
//
// ERROR is a number of errno; or a signal, "kill" or "stop"; or "none", which only logs. Only calls
// that change something count, and of these only those on a path that has PART in it.

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <csignal>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

namespace {

struct Fault {
    std::string call;
    long number = 0;
    bool all_after = false;
    int error = 0;
    int signal = 0;  // instead
    std::string part;
};

Fault read_fault() {
    Fault fault;
    const char* text = std::getenv("MERL_SCAN_FAULT");
    if (text == nullptr) {
        return fault;
    }
    std::string rest = text;
    const auto field = [&] {
        const auto end = std::min(rest.find(':'), rest.size());
        const std::string first = rest.substr(0, end);
        rest.erase(0, std::min(end + 1, rest.size()));
        return first;
    };
    fault.call = field();
    const std::string number = field();
    fault.number = std::atol(number.c_str());
    fault.all_after = number.back() == '+';
    const std::string error = field();
    fault.signal = error == "kill" ? SIGKILL : error == "stop" ? SIGSTOP : 0;
    fault.error = std::atoi(error.c_str());
    fault.part = rest;
    return fault;
}

std::string path_of(int descriptor) {
    char path[PATH_MAX] = {};
    const std::string link = "/proc/self/fd/" + std::to_string(descriptor);
    return ::readlink(link.c_str(), path, sizeof(path) - 1) < 0 ? "" : path;
}

std::string path_at(int directory, const char* path) {
    return directory == AT_FDCWD || path[0] == '/' ? path : path_of(directory) + "/" + path;
}

/// Whether this call is to fail; errno is set then. A signal comes before the call.
bool strikes(const char* call, const std::string& path) {
    static const Fault fault = read_fault();
    static std::atomic<long> count = 0;
    if ((fault.call != call && fault.call != "any") || path.find(fault.part) == std::string::npos) {
        return false;
    }
    const long number = ++count;
    if (number < fault.number || (number > fault.number && !fault.all_after)) {
        return false;
    }
    if (const char* log = std::getenv("MERL_SCAN_FAULT_LOG")) {
        const long file = ::syscall(SYS_openat, AT_FDCWD, log, O_WRONLY | O_CREAT | O_APPEND, 0666);
        const std::string line = std::string(call) + " " + path + "\n";
        ::syscall(SYS_write, file, line.data(), line.size());
        ::close(static_cast<int>(file));
    }
    if (fault.signal != 0) {
        ::kill(::getpid(), fault.signal);
    }
    errno = fault.error;
    return fault.error != 0;
}

int open_at(int directory, const char* path, int flags, mode_t mode) {
    const bool changes = (flags & (O_WRONLY | O_RDWR | O_CREAT)) != 0;
    if (changes && strikes("open", path_at(directory, path))) {
        return -1;
    }
    return static_cast<int>(::syscall(SYS_openat, directory, path, flags, mode));
}

int unlink_at(int directory, const char* path, int flags) {
    if (strikes("unlink", path_at(directory, path))) {
        return -1;
    }
    return static_cast<int>(::syscall(SYS_unlinkat, directory, path, flags));
}

int rename_at(int from, const char* old_path, int to, const char* new_path, unsigned flags) {
    if (strikes("rename", path_at(from, old_path) + " " + path_at(to, new_path))) {
        return -1;
    }
    return static_cast<int>(::syscall(SYS_renameat2, from, old_path, to, new_path, flags));
}

mode_t mode_of(int flags, std::va_list arguments) {
    return (flags & (O_CREAT | O_TMPFILE)) != 0 ? static_cast<mode_t>(va_arg(arguments, int)) : 0;
}

}  // namespace

extern "C" {

#define MERL_SCAN_OPEN(name)                           \
    int name(const char* path, int flags, ...) {       \
        std::va_list arguments;                        \
        va_start(arguments, flags);                    \
        const mode_t mode = mode_of(flags, arguments); \
        va_end(arguments);                             \
        return open_at(AT_FDCWD, path, flags, mode);   \
    }
#define MERL_SCAN_OPENAT(name)                                  \
    int name(int directory, const char* path, int flags, ...) { \
        std::va_list arguments;                                 \
        va_start(arguments, flags);                             \
        const mode_t mode = mode_of(flags, arguments);          \
        va_end(arguments);                                      \
        return open_at(directory, path, flags, mode);           \
    }
MERL_SCAN_OPEN(open)
MERL_SCAN_OPEN(open64)
MERL_SCAN_OPENAT(openat)
MERL_SCAN_OPENAT(openat64)

int mkdir(const char* path, mode_t mode) {
    return strikes("mkdir", path) ? -1
                                  : static_cast<int>(::syscall(SYS_mkdirat, AT_FDCWD, path, mode));
}

int rename(const char* from, const char* to) {
    return rename_at(AT_FDCWD, from, AT_FDCWD, to, 0);
}

int renameat2(int from, const char* old_path, int to, const char* new_path, unsigned flags) {
    return rename_at(from, old_path, to, new_path, flags);
}

int unlink(const char* path) {
    return unlink_at(AT_FDCWD, path, 0);
}

int unlinkat(int directory, const char* path, int flags) {
    return unlink_at(directory, path, flags);
}

int rmdir(const char* path) {
    return unlink_at(AT_FDCWD, path, AT_REMOVEDIR);
}

int remove(const char* path) {
    struct stat status = {};
    const bool directory = ::lstat(path, &status) == 0 && S_ISDIR(status.st_mode);
    return unlink_at(AT_FDCWD, path, directory ? AT_REMOVEDIR : 0);
}

int fsync(int descriptor) {
    return strikes("fsync", path_of(descriptor))
               ? -1
               : static_cast<int>(::syscall(SYS_fsync, descriptor));
}

int flock(int descriptor, int operation) {
    return strikes("flock", path_of(descriptor))
               ? -1
               : static_cast<int>(::syscall(SYS_flock, descriptor, operation));
}

ssize_t write(int descriptor, const void* bytes, size_t count) {
    return strikes("write", path_of(descriptor))
               ? -1
               : static_cast<ssize_t>(::syscall(SYS_write, descriptor, bytes, count));
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*run)(void*),
                   void* argument) {
    const char* const fault = std::getenv("MERL_SCAN_FAULT");
    if (fault != nullptr && std::string(fault).starts_with("thread:") && strikes("thread", "")) {
        return errno;
    }
    using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static const auto create = reinterpret_cast<Create>(::dlsym(RTLD_NEXT, "pthread_create"));
    return create(thread, attributes, run, argument);
}
}
