#include "engine/database/merl_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <system_error>

#include "engine/base/error.h"
#include "engine/database/merl_file.h"

namespace merl::engine {
namespace {

bool has_merl_extension(const std::filesystem::path& path) {
    std::string extension = path.extension().string();
    std::transform(extension.begin(), extension.end(), extension.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return extension == ".binary";
}

class MerlDatabase final : public Database {
  public:
    /// `name` is what it is called and where it is.
    MerlDatabase(const std::filesystem::path& name, const char* kind,
                 std::vector<MerlEntry> entries)
        : Database(name.string(), kind,
                   std::filesystem::absolute(name).lexically_normal().string()),
          entries_(std::move(entries)) {
        for (const auto& entry : entries_) {
            const auto& header = headers_.emplace_back(read_merl_header(entry.path));
            const Grid& grid = header.grid;
            if (materials_.empty()) {
                grid_ = grid;
            } else if (grid != grid_) {
                throw InputError(fmt::format(
                    "{}: the grid is {}; {} has {}, and all files of a database must have the same",
                    entry.path.string(), grid.text(), entries_.front().path.string(),
                    grid_.text()));
            }
            materials_.push_back(entry.material);
        }
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        read_merl_samples(entries_.at(material).path, headers_.at(material), range, samples, sink);
    }

  private:
    std::vector<MerlEntry> entries_;
    std::vector<MerlHeader> headers_;  // of each, when it was first opened
};

MerlEntry entry_of(const std::filesystem::path& path) {
    return {path.stem().string(), path};
}

}  // namespace

std::vector<MerlEntry> list_merl_directory(const std::filesystem::path& directory) {
    std::vector<MerlEntry> entries;
    try {
        for (const auto& file : std::filesystem::directory_iterator(directory)) {
            const auto& path = file.path();
            if (has_merl_extension(path) && path.filename().string().front() != '.') {
                entries.push_back(entry_of(path));
            }
        }
    } catch (const std::filesystem::filesystem_error& error) {
        std::error_code none;
        throw InputError(fmt::format(
            "{}: cannot be read as a directory of .binary files: {}{}", directory.string(),
            error.code().message(),
            std::filesystem::is_regular_file(directory, none) && has_merl_extension(directory)
                ? "; a database is the directory that the file is in"
                : ""));
    }
    std::sort(entries.begin(), entries.end(), [](const MerlEntry& a, const MerlEntry& b) {
        return std::tie(a.material, a.path) < std::tie(b.material, b.path);
    });
    const auto twin = std::adjacent_find(
        entries.begin(), entries.end(),
        [](const MerlEntry& a, const MerlEntry& b) { return a.material == b.material; });
    if (twin != entries.end()) {
        throw InputError(fmt::format("{} and {} name the same material; material names must differ",
                                     twin->path.string(), std::next(twin)->path.string()));
    }
    return entries;
}

std::unique_ptr<Database> open_merl_directory(const std::filesystem::path& directory) {
    auto entries = list_merl_directory(directory);
    if (entries.size() < 2) {
        throw InputError(
            fmt::format("{}: found {} .binary file{}; a scan needs at least two materials",
                        directory.string(), entries.size(), entries.size() == 1 ? "" : "s"));
    }
    return std::make_unique<MerlDatabase>(directory, "MERL directory", std::move(entries));
}

std::vector<MerlEntry> list_merl_files(const std::filesystem::path& path) {
    std::error_code none;
    if (std::filesystem::is_directory(path, none)) {
        return list_merl_directory(path);
    }
    read_merl_header(path);  // throws unless it is a MERL file
    return {entry_of(path)};
}

std::unique_ptr<Database> open_merl_file(const std::filesystem::path& path) {
    return std::make_unique<MerlDatabase>(path, "MERL file", std::vector{entry_of(path)});
}

}  // namespace merl::engine
