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
#include "engine/base/file.h"
#include "engine/base/hash.h"
#include "scan/io/csv.h"

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

/// The hash of a file that was written, from what is there now.
std::string hash_of_file(const fs::path& path) {
    constexpr std::uint64_t kPart = std::uint64_t{1} << 20U;
    try {
        const File file(path);
        Hash hash;
        std::vector<std::byte> bytes;
        for (std::uint64_t at = 0; at < file.bytes(); at += bytes.size()) {
            bytes.resize(std::min(kPart, file.bytes() - at));
            file.read(at, bytes);
            hash.update(bytes);
        }
        return hash.hexadecimal();
    } catch (const InputError& error) {  // not of the user's
        throw Error(Fault::output, error.what());
    }
}

}  // namespace

OutputDirectory::OutputDirectory(const fs::path& target, bool force, std::vector<OutputFile> files,
                                 const std::vector<fs::path>& inputs)
    : OutputDirectory(target, force ? Existing::replace : Existing::refuse, std::move(files),
                      inputs) {}

OutputDirectory OutputDirectory::for_files(const fs::path& directory, bool force,
                                           std::vector<OutputFile> files) {
    return {directory, force ? Existing::replace : Existing::add, std::move(files), {}};
}

OutputDirectory::OutputDirectory(const fs::path& target, Existing existing,
                                 std::vector<OutputFile> files, const std::vector<fs::path>& inputs)
    : target_(plain(target)), files_(std::move(files)) {
    std::vector<std::string> names(files_.size());
    std::ranges::transform(files_, names.begin(), &OutputFile::name);
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
            for (const auto& name : names) {
                require_possible(path(name));
            }
        } else {
            staging_.reset();
            stage_in_existing(existing, names, inputs);
        }
    } catch (const std::system_error& error) {
        fail(target_,
             fmt::format("cannot be {}: {}", make ? "made" : "written to", error.code().message()));
    }
}

void OutputDirectory::stage_in_existing(Existing existing, const std::vector<std::string>& names,
                                        const std::vector<fs::path>& inputs) {
    std::error_code none;
    if (!fs::is_directory(target_, none)) {
        fail(target_, "exists and is not a directory; choose another --out");
    }
    finish_stopped_runs(target_, names);
    if (existing == Existing::refuse) {
        fail(target_, "exists already; choose another --out, or --force to replace its results");
    }
    require_own_summary(target_, names);
    for (const auto& name : names) {
        require_possible(target_ / name);
        require_no_input(target_ / name, inputs);
        require_replaceable(target_ / name);
    }
    staging_ = std::make_unique<Staging>(target_, existing == Existing::replace, names);
    for (const auto& name : names) {
        if (existing == Existing::add && is_there(target_ / name)) {
            fail(target_ / name, "exists; --force replaces it");
        }
    }
}

fs::path OutputDirectory::path(const std::string& name) const {
    return staging_->path(directory_.empty() ? name : directory_ + "/" + name);
}

void OutputDirectory::write_file(const OutputFile& file,
                                 const std::function<void(int descriptor)>& write) {
    if (!written_.insert(file.name).second) {
        throw std::logic_error(fmt::format("{} is written twice", file.name));
    }
    const auto place = path(file.name);
    int descriptor = ::open(place.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0) {
        fail(target_ / file.name, fmt::format("cannot be created: {}", std::strerror(errno)));
    }
    try {
        write(descriptor);
        sync_file(descriptor);
        if (::close(std::exchange(descriptor, -1)) != 0) {
            throw std::system_error(errno, std::generic_category());
        }
    } catch (const std::system_error& error) {
        ::close(descriptor);
        fail(target_ / file.name, fmt::format("cannot be written: {}", error.code().message()));
    } catch (...) {
        ::close(descriptor);
        throw;
    }
    if (file.is_read_again) {
        hashes_.emplace_back(file.name, hash_of_file(place));
    }
}

void OutputDirectory::write(const std::string& name, std::string_view bytes) {
    const auto file = std::ranges::find(files_, name, &OutputFile::name);
    if (file == files_.end() || file->write) {
        throw std::logic_error(
            fmt::format("{} is not one of the files that come one by one", name));
    }
    write_file(*file, [&](int descriptor) { scan::write_all(descriptor, bytes); });
}

void OutputDirectory::finish() {
    for (const auto& file : files_) {
        if (file.write) {
            throw_if_interrupted();
            write_file(file, file.write);
        }
    }
    if (written_.size() != files_.size()) {
        throw std::logic_error(fmt::format("of {} files that were stated {} are written",
                                           files_.size(), written_.size()));
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
