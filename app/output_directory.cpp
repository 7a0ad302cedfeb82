#include "app/output_directory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <system_error>

#include "engine/error.h"

namespace merl::app {
namespace {

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& what) {
    throw Error(Fault::output, fmt::format("{}: {}", path.string(), what));
}

}  // namespace

OutputDirectory::OutputDirectory(const std::filesystem::path& target, bool force,
                                 std::vector<std::string> owned)
    : target_(std::filesystem::absolute(target).lexically_normal()), owned_(std::move(owned)) {
    if (!target_.has_filename()) {
        target_ = target_.parent_path();  // "results/" means "results"
    }
    std::error_code code;
    const auto status = std::filesystem::symlink_status(target_, code);
    if (std::filesystem::exists(status)) {
        if (!std::filesystem::is_directory(target_, code)) {
            fail(target_, "exists and is not a directory; choose another --out");
        }
        if (!force) {
            fail(target_,
                 "exists already; choose another --out, or --force to replace its results");
        }
        replace_ = true;
    }
    std::string hidden = fmt::format("{}/.{}.partial-XXXXXX", target_.parent_path().string(),
                                     target_.filename().string());
    if (::mkdtemp(hidden.data()) == nullptr) {
        fail(target_, fmt::format("cannot be made: {}", std::strerror(errno)));
    }
    partial_ = hidden;
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

void OutputDirectory::commit() {
    try {
        if (!replace_) {
            std::filesystem::rename(partial_, target_);
        } else {
            // Without its last file a set of results is not complete, so that one goes first and
            // comes last.
            for (auto name = owned_.rbegin(); name != owned_.rend(); ++name) {
                std::filesystem::remove(target_ / *name);
            }
            for (const auto& name : owned_) {
                if (std::filesystem::exists(partial_ / name)) {
                    std::filesystem::rename(partial_ / name, target_ / name);
                }
            }
            std::filesystem::remove_all(partial_);
        }
    } catch (const std::filesystem::filesystem_error& error) {
        fail(target_, fmt::format("cannot be put into place: {}", error.code().message()));
    }
    partial_.clear();
}

}  // namespace merl::app
