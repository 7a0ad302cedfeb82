#include "app/output_directory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "app/interrupt.h"
#include "engine/error.h"

namespace merl::app {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
    throw Error(Fault::output, fmt::format("{}: {}", path.string(), what));
}

bool is_there(const std::filesystem::path& path) {
    return std::filesystem::exists(std::filesystem::symlink_status(path));
}

/// Only files can be replaced: a directory may hold anything.
void require_no_directory(const std::filesystem::path& path) {
    std::error_code code;
    if (std::filesystem::is_directory(std::filesystem::symlink_status(path, code))) {
        fail(path, "is a directory where a result has to go; move it away");
    }
}

}  // namespace

OutputDirectory::OutputDirectory(const std::filesystem::path& target, bool force,
                                 std::vector<std::string> owned)
    : owned_(std::move(owned)) {
    std::error_code code;
    target_ = std::filesystem::absolute(target, code).lexically_normal();
    if (code) {
        fail(target, fmt::format("cannot be made: the working directory: {}", code.message()));
    }
    if (!target_.has_filename()) {
        target_ = target_.parent_path();  // "results/" means "results"
    }
    const auto status = std::filesystem::symlink_status(target_, code);
    if (std::filesystem::exists(status)) {
        if (!std::filesystem::is_directory(target_, code)) {
            fail(target_, "exists and is not a directory; choose another --out");
        }
        if (!force) {
            fail(target_,
                 "exists already; choose another --out, or --force to replace its results");
        }
        for (const auto& name : owned_) {
            require_no_directory(target_ / name);
        }
        replace_ = true;
    }
    std::string hidden = replace_
                             ? fmt::format("{}/.merl-scan.partial-XXXXXX", target_.string())
                             : fmt::format("{}/.{}.partial-XXXXXX", target_.parent_path().string(),
                                           target_.filename().string());
    if (::mkdtemp(hidden.data()) == nullptr) {
        fail(target_, fmt::format("cannot be {}: {}", replace_ ? "written to" : "made",
                                  std::strerror(errno)));
    }
    partial_ = hidden;
    set_unfinished(partial_);
    std::filesystem::permissions(partial_, std::filesystem::perms(0755), code);
}

OutputDirectory::~OutputDirectory() {
    std::error_code ignored;
    if (!partial_.empty()) {
        std::filesystem::remove_all(partial_, ignored);
    }
}

void OutputDirectory::write(const std::string& name,
                            const std::function<void(int descriptor)>& write) const {
    const auto file = path(name);
    const int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644);
    if (descriptor < 0) {
        fail(target_ / name, fmt::format("cannot be created: {}", std::strerror(errno)));
    }
    try {
        write(descriptor);
    } catch (const std::system_error& error) {
        ::close(descriptor);
        fail(target_ / name, fmt::format("cannot be written: {}", error.code().message()));
    } catch (...) {
        ::close(descriptor);
        throw;
    }
    if (::close(descriptor) != 0) {
        fail(target_ / name, fmt::format("cannot be written: {}", std::strerror(errno)));
    }
}

std::string OutputDirectory::with_target(std::string message) const {
    const std::string hidden = partial_.string();
    for (auto at = message.find(hidden); at != std::string::npos; at = message.find(hidden)) {
        message.replace(at, hidden.size(), target_.string());
    }
    return message;
}

void OutputDirectory::commit() {
    throw_if_interrupted();
    finish_in_any_case();
    try {
        if (replace_) {
            replace();
        } else {
            std::filesystem::rename(partial_, target_);
        }
    } catch (const std::filesystem::filesystem_error& error) {
        fail(target_, fmt::format("cannot be put into place: {}", error.code().message()));
    }
    partial_.clear();
}

/// Moves the old files into the hidden directory, then the new ones out of it. Without its last
/// file a set of results is not complete, so that one goes first and comes last.
void OutputDirectory::replace() const {
    for (const auto& name : owned_) {
        require_no_directory(target_ / name);
    }
    const auto old = partial_ / ".old";
    std::vector<std::string> moved;
    std::vector<std::string> placed;
    try {
        std::filesystem::create_directory(old);
        for (auto name = owned_.rbegin(); name != owned_.rend(); ++name) {
            if (is_there(target_ / *name)) {
                std::filesystem::rename(target_ / *name, old / *name);
                moved.push_back(*name);
            }
        }
        for (const auto& name : owned_) {
            if (is_there(partial_ / name)) {
                std::filesystem::rename(partial_ / name, target_ / name);
                placed.push_back(name);
            }
        }
    } catch (...) {
        std::error_code ignored;
        for (const auto& name : placed) {
            std::filesystem::remove(target_ / name, ignored);
        }
        for (auto name = moved.rbegin(); name != moved.rend(); ++name) {
            std::filesystem::rename(old / *name, target_ / *name, ignored);
        }
        throw;
    }
    std::error_code ignored;
    std::filesystem::remove_all(partial_, ignored);
}

}  // namespace merl::app
