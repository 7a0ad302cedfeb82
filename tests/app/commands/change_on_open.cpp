// Preloaded into the program by provenance_test.py: when the program opens a file for the Nth time,
// another takes its place first. That is a moment no other process could hit for sure.

#include <dlfcn.h>
#include <fcntl.h>

#include <atomic>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

/// CHANGE_FILE is how the path ends, CHANGE_AT the N, CHANGE_TO what takes its place; how often it
/// was opened goes to CHANGE_COUNT.
void before_opening(const char* path) {
    static std::atomic<int> opened = 0;
    const char* const file = std::getenv("CHANGE_FILE");
    const std::size_t length = std::strlen(path);
    if (file == nullptr || length < std::strlen(file) ||
        std::strcmp(path + length - std::strlen(file), file) != 0) {
        return;
    }
    const int count = ++opened;
    if (count == std::atoi(std::getenv("CHANGE_AT"))) {
        std::rename(std::getenv("CHANGE_TO"), path);
    }
    if (std::FILE* const log = std::fopen(std::getenv("CHANGE_COUNT"), "w")) {
        std::fprintf(log, "%d", count);
        std::fclose(log);
    }
}

int open_as(const char* function, const char* path, int flags, mode_t mode) {
    before_opening(path);
    using Open = int (*)(const char*, int, ...);
    return reinterpret_cast<Open>(::dlsym(RTLD_NEXT, function))(path, flags, mode);
}

}  // namespace

extern "C" int open(const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return open_as("open", path, flags, mode);
}

extern "C" int open64(const char* path, int flags, ...) {
    va_list rest;
    va_start(rest, flags);
    const mode_t mode = (flags & O_CREAT) != 0 ? va_arg(rest, mode_t) : 0;
    va_end(rest);
    return open_as("open64", path, flags, mode);
}
