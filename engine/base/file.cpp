#include "engine/base/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "engine/base/error.h"

namespace merl {
namespace {

/// Longer than any step of the kernel's clock that files get their times from.
constexpr std::int64_t kClockStepNs = 20'000'000;

std::int64_t nanoseconds(const timespec& time) {
    return std::int64_t{time.tv_sec} * 1'000'000'000 + time.tv_nsec;
}

FileState state_of(const struct stat& status) {
    return {.device = status.st_dev,
            .inode = status.st_ino,
            .bytes = static_cast<std::uint64_t>(status.st_size),
            .modified_ns = nanoseconds(status.st_mtim),
            .changed_ns = nanoseconds(status.st_ctim)};
}

std::string difference(const FileState& expected, const FileState& found) {
    return found.device != expected.device || found.inode != expected.inode
               ? std::string("another file is in its place")
           : found.bytes != expected.bytes
               ? fmt::format("it had {} bytes and has {}", expected.bytes, found.bytes)
           : found.modified_ns != expected.modified_ns ? "it was written to"
                                                       : "its time of change (ctime) is another";
}

}  // namespace

File::File(const std::filesystem::path& path)
    : path_(path), descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
    if (descriptor_ < 0) {
        fail(fmt::format("cannot be opened: {}", std::strerror(errno)));
    }
    struct stat status = {};
    if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
        ::close(descriptor_);
        fail("is not a regular file");
    }
    state_ = state_of(status);
}

File::~File() {
    ::close(descriptor_);
}

void File::expect(const FileState& expected) const {
    struct stat status = {};
    if (::fstat(descriptor_, &status) != 0) {
        fail(fmt::format("cannot be read: {}", std::strerror(errno)));
    }
    for (const auto& found : {state_, state_of(status)}) {
        if (found != expected) {
            fail(
                fmt::format("changed while it was read: {}; run the command again when nothing "
                            "writes to the database",
                            difference(expected, found)));
        }
    }
}

void File::settle() {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const std::int64_t age =
        std::chrono::duration_cast<std::chrono::nanoseconds>(now).count() - state_.changed_ns;
    if (age >= 0 && age < kClockStepNs) {
        std::this_thread::sleep_for(std::chrono::nanoseconds(kClockStepNs - age));
        struct stat status = {};
        if (::fstat(descriptor_, &status) == 0) {
            state_ = state_of(status);
        }
    }
}

void File::read(std::uint64_t offset, std::span<std::byte> to) const {
    while (!to.empty()) {
        const auto got = ::pread(descriptor_, to.data(), to.size(), static_cast<off_t>(offset));
        if (got < 0 && errno == EINTR) {
            continue;
        }
        if (got <= 0) {
            fail(got < 0
                     ? fmt::format("cannot be read at byte {}: {}", offset, std::strerror(errno))
                     : fmt::format("ends at byte {} while it is read; it had {} bytes", offset,
                                   bytes()));
        }
        offset += static_cast<std::uint64_t>(got);
        to = to.subspan(static_cast<std::size_t>(got));
    }
}

std::string File::read_all(std::uint64_t most) const {
    if (bytes() > most) {
        fail(fmt::format("has {} bytes; expected {} or fewer", bytes(), most));
    }
    std::string text(bytes(), '\0');
    read(0, std::as_writable_bytes(std::span(text)));
    return text;
}

void File::fail(const std::string& what) const {
    throw InputError(fmt::format("{}: {}", path_.string(), what));
}

}  // namespace merl
