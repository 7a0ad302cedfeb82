#include "scan/input.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <system_error>

namespace merl::scan {
namespace {

/// An open file that closes itself.
class File {
  public:
    explicit File(const std::string& path)
        // Non-blocking, so that a FIFO is refused and not waited for.
        : path_(path), descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
        if (descriptor_ < 0) {
            const int code = errno;
            fail(fmt::format("cannot be opened: {}{}", std::strerror(code),
                             code == ENOENT ? stopped_run_beside(path) : ""));
        }
    }
    ~File() { ::close(descriptor_); }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    std::uint64_t bytes() const {
        struct stat status = {};
        if (::fstat(descriptor_, &status) != 0 || !S_ISREG(status.st_mode)) {
            fail("is not a regular file");
        }
        return static_cast<std::uint64_t>(status.st_size);
    }

    void read(std::string& text) const {
        std::size_t have = 0;
        while (have < text.size()) {
            const auto got = ::read(descriptor_, text.data() + have, text.size() - have);
            if (got < 0 && errno == EINTR) {
                continue;
            }
            if (got <= 0) {
                fail(got < 0 ? fmt::format("cannot be read: {}", std::strerror(errno))
                             : fmt::format("ends at byte {} while it is read; it had {} bytes",
                                           have, text.size()));
            }
            have += static_cast<std::size_t>(got);
        }
    }

    [[noreturn]] void fail(const std::string& what) const {
        throw InputError(fmt::format("{}: {}", path_, what));
    }

  private:
    const std::string& path_;
    int descriptor_;
};

}  // namespace

std::string stopped_run_beside(const std::string& path) {
    std::error_code code;
    const auto parent = std::filesystem::path(path).parent_path();
    for (std::filesystem::directory_iterator i(parent.empty() ? "." : parent, code), end;
         !code && i != end; i.increment(code)) {
        if (i->path().filename().string().starts_with(stopped_run_prefix)) {
            return fmt::format(
                "; a run that is at work or was stopped has results in {}, and the "
                "next one into that directory puts them into place",
                i->path().string());
        }
    }
    return "";
}

std::string_view json_fault(const std::exception& error) {
    // After "[json.exception.parse_error.101] ".
    const std::string_view text = error.what();
    return text.substr(std::min(text.find(' ') + 1, text.size()));
}

std::string_view without_byte_order_mark(std::string_view text) {
    constexpr std::string_view mark = "\xef\xbb\xbf";
    return text.starts_with(mark) ? text.substr(mark.size()) : text;
}

std::string read_input(const std::string& path, std::uint64_t most) {
    const File file(path);
    const std::uint64_t bytes = file.bytes();
    if (bytes == 0) {
        file.fail("is empty");
    }
    if (bytes > most) {
        file.fail(fmt::format("has {} bytes; expected {} or fewer", bytes, most));
    }
    std::string text(bytes, '\0');
    file.read(text);
    return text;
}

}  // namespace merl::scan
