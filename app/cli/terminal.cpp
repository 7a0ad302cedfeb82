#include "app/cli/terminal.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstring>

#include "engine/base/error.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

/// Whether standard output is a pipe or a socket without a reader.
bool nobody_reads() {
    struct stat status = {};
    pollfd output = {.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
    return ::fstat(STDOUT_FILENO, &status) == 0 &&
           (S_ISFIFO(status.st_mode) || S_ISSOCK(status.st_mode)) && ::poll(&output, 1, 0) > 0 &&
           (output.revents & (POLLERR | POLLHUP)) != 0;
}

bool unread = false;  // from the first line on that nobody read

}  // namespace

void print_line(std::string_view text) {
    if (!unread) {
        std::fputs((printable(text) + "\n").c_str(), stdout);
        flush_output();
    }
}

void print_lines(std::string_view text) {
    while (!text.empty()) {
        const auto end = std::min(text.find('\n'), text.size());
        print_line(text.substr(0, end));
        text.remove_prefix(std::min(end + 1, text.size()));
    }
}

void print_result(std::string_view name, std::string_view text) {
    print_line(fmt::format("{:<16}{}", name, text));
}

void print_warning(std::string_view text) {
    std::fputs(fmt::format("merl-scan: warning: {}\n", printable(text)).c_str(), stderr);
}

std::size_t width_of(std::string_view text) {
    return printable(text).size();
}

std::string padded(std::string_view text, std::size_t width) {
    return std::string(text) + std::string(width - std::min(width, width_of(text)), ' ');
}

void flush_output() {
    if (unread || (std::fflush(stdout) == 0 && std::ferror(stdout) == 0)) {
        return;
    }
    const int code = errno;
    unread = nobody_reads();
    if (!unread) {
        throw Error(Fault::output,
                    fmt::format("standard output cannot be written: {}", std::strerror(code)));
    }
}

}  // namespace merl::app
