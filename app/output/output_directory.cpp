#include "app/output/output_directory.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "app/cli/interrupt.h"
#include "engine/base/error.h"

namespace merl::app {
namespace {

namespace fs = std::filesystem;

bool in_place = false;

[[noreturn]] void fail(const fs::path& path, const std::string& what) {
    throw Error(Fault::output, fmt::format("{}: {}", path.string(), what));
}

/// The same path from anywhere, without what may follow a name: "results/" means "results". Dots
/// within it stay: before them may be a symbolic link.
fs::path plain(const fs::path& target) {
    std::error_code code;
    auto path = fs::absolute(target, code);
    if (code) {
        fail(target, fmt::format("cannot be made: the working directory: {}", code.message()));
    }
    while (path.has_relative_path() && (path.filename().empty() || path.filename() == ".")) {
        path = path.parent_path();
    }
    return path;
}

/// Whether it is there. What cannot even be looked at will not be made either, which then says why.
bool seems_there(const fs::path& path) {
    std::error_code code;
    return fs::exists(fs::symlink_status(path, code));
}

/// A name that is too long is found before hours of work.
void require_possible(const fs::path& file) {
    std::error_code code;
    if (fs::symlink_status(file, code).type() == fs::file_type::none) {
        fail(file, fmt::format("cannot be created: {}", code.message()));
    }
}

constexpr const char* kSummary = "summary.json";

/// Every set of results has a summary of its own, of the same name.
void require_own_summary(const fs::path& directory, const std::vector<std::string>& names) {
    const auto there = [&](const std::string& name) { return seems_there(directory / name); };
    if (names.back() == kSummary && there(kSummary) &&
        std::none_of(names.begin(), names.end() - 1, there)) {
        fail(directory / kSummary,
             fmt::format("belongs to other results, for there is no {}; choose another --out",
                         names.front()));
    }
}

void require_no_input(const fs::path& file, const std::vector<fs::path>& inputs) {
    for (const auto& input : inputs) {
        std::error_code none;
        if (fs::equivalent(file, input, none)) {
            fail(file, "is read and would be replaced; choose another --out");
        }
    }
}

}  // namespace

OutputDirectory::OutputDirectory(const fs::path& target, bool force, std::vector<std::string> names,
                                 const std::vector<fs::path>& inputs)
    : OutputDirectory(target, force ? Existing::replace : Existing::refuse, std::move(names),
                      inputs) {}

OutputDirectory OutputDirectory::for_files(const fs::path& directory, bool force,
                                           std::vector<std::string> names) {
    return {directory, force ? Existing::replace : Existing::add, std::move(names), {}};
}

OutputDirectory::OutputDirectory(const fs::path& target, Existing existing,
                                 std::vector<std::string> names,
                                 const std::vector<fs::path>& inputs)
    : target_(plain(target)), missing_(std::move(names)) {
    const auto parent = target_.parent_path();
    const auto name_of_target = target_.filename().string();
    finish_stopped_runs(parent, {name_of_target});
    bool make = !seems_there(target_);
    try {
        if (make) {
            staging_ = std::make_unique<Staging>(parent, false, std::vector{name_of_target});
            make = !seems_there(target_);  // another run may just have ended
        }
        if (make) {
            directory_ = name_of_target;
            fs::create_directory(staging_->path(directory_));
            for (const auto& name : missing_) {
                require_possible(path(name));
            }
        } else {
            staging_.reset();
            stage_in_existing(existing, inputs);
        }
    } catch (const std::system_error& error) {
        fail(target_,
             fmt::format("cannot be {}: {}", make ? "made" : "written to", error.code().message()));
    }
}

void OutputDirectory::stage_in_existing(Existing existing, const std::vector<fs::path>& inputs) {
    std::error_code none;
    if (!fs::is_directory(target_, none)) {
        fail(target_, "exists and is not a directory; choose another --out");
    }
    finish_stopped_runs(target_, missing_);
    if (existing == Existing::refuse) {
        fail(target_, "exists already; choose another --out, or --force to replace its results");
    }
    require_own_summary(target_, missing_);
    for (const auto& name : missing_) {
        require_possible(target_ / name);
        require_no_input(target_ / name, inputs);
        require_replaceable(target_ / name);
    }
    staging_ = std::make_unique<Staging>(target_, existing == Existing::replace, missing_);
    for (const auto& name : missing_) {
        if (existing == Existing::add && is_there(target_ / name)) {
            fail(target_ / name, "exists; --force replaces it");
        }
    }
}

fs::path OutputDirectory::path(const std::string& name) const {
    return staging_->path(directory_.empty() ? name : directory_ + "/" + name);
}

void OutputDirectory::write(const std::string& name,
                            const std::function<void(int descriptor)>& write) {
    if (std::erase(missing_, name) != 1) {
        throw std::logic_error(fmt::format("{} is written and was not declared once", name));
    }
    const auto file = path(name);
    int descriptor = ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0) {
        fail(target_ / name, fmt::format("cannot be created: {}", std::strerror(errno)));
    }
    try {
        write(descriptor);
        sync_file(descriptor);
        if (::close(std::exchange(descriptor, -1)) != 0) {
            throw std::system_error(errno, std::generic_category());
        }
    } catch (const std::system_error& error) {
        ::close(descriptor);
        fail(target_ / name, fmt::format("cannot be written: {}", error.code().message()));
    } catch (...) {
        ::close(descriptor);
        throw;
    }
}

void OutputDirectory::commit() {
    if (!missing_.empty()) {
        throw std::logic_error(fmt::format("{} was declared and is not written", missing_.front()));
    }
    throw_if_interrupted();
    finish_in_any_case();
    staging_->put_into_place();
    in_place = true;
}

bool results_are_in_place() {
    return in_place;
}

}  // namespace merl::app
