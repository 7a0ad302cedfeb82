#include "engine/database/merl_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "engine/base/error.h"
#include "engine/database/bad_files.h"
#include "engine/database/merl_file.h"
#include "engine/database/over_two_pi.h"

namespace merl::engine {
namespace {

constexpr const char* kExtension = ".binary";

/// The file whose grid a database takes: the first of those whose grid over pi most files have.
/// `files` are at least one.
std::size_t typical_file(const std::vector<MerlHeader>& headers,
                         const std::vector<std::size_t>& files) {
    const auto like = [&](std::size_t file) {
        return std::ranges::count_if(files, [&](std::size_t other) {
            return headers[other].grid.over_pi() == headers[file].grid.over_pi();
        });
    };
    return *std::ranges::max_element(files, {}, like);
}

class MerlDatabase final : public Database {
  public:
    /// `name` is what it is called and where it is.
    MerlDatabase(const std::filesystem::path& name, const char* kind,
                 std::vector<MaterialFile> files, const OpenOptions& options)
        : Database(name.string(), kind,
                   std::filesystem::absolute(name).lexically_normal().string()),
          files_(std::move(files)) {
        std::vector<MerlHeader> headers(files_.size());
        auto faults = faults_of(files_.size(), [&](std::size_t i) {
            headers[i] = read_merl_header(files_[i].path, options.phi_d_range);
            if (options.skip_bad) {
                check_merl_samples(files_[i].path, headers[i]);
            }
        });
        choose_grid(headers, faults);
        for (std::size_t i = 0; i < files_.size(); ++i) {
            if (faults[i].empty()) {
                headers_.push_back(headers[i]);
                materials_.push_back(files_[i].material);
            }
        }
        skipped_ = skip_bad(name_, files_, faults, options);
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        const auto& path = files_.at(material).path;
        const auto& header = headers_.at(material);
        const auto from_file = [&](VoxelRange part, std::span<double> to, const SampleSink& hash) {
            read_merl_samples(path, header, part, to, hash);
        };
        try {
            if (header.grid == grid_) {
                from_file(range, samples, sink);
            } else {
                read_over_two_pi(grid_, range, samples, sink, from_file);
            }
        } catch (const InputError& error) {
            bad_.fail(*this, error, [&](std::size_t other) {
                check_merl_samples(files_[other].path, headers_[other]);
            });
        }
    }

    std::string place_of(std::size_t material) const override {
        return files_.at(material).path.string();
    }

  private:
    /// Sets the grid, and finds fault with good files of another.
    void choose_grid(const std::vector<MerlHeader>& headers, std::vector<std::string>& faults) {
        std::vector<std::size_t> good;
        for (std::size_t i = 0; i < files_.size(); ++i) {
            if (faults[i].empty()) {
                good.push_back(i);
            }
        }
        if (good.empty()) {
            return;
        }
        const std::size_t typical = typical_file(headers, good);
        grid_ = headers[typical].grid;
        for (const auto i : good) {
            const Grid& grid = headers[i].grid;
            if (grid.over_pi() != grid_.over_pi()) {
                faults[i] = fmt::format(
                    "{}: the grid is {}; {} has {}, and all files of a database must have the same",
                    files_[i].path.string(), grid.text(), files_[typical].path.string(),
                    headers[typical].grid.text());
            } else if (grid.phi_d_range == PhiDRange::two_pi) {
                grid_ = grid;
            }
        }
    }

    std::vector<MaterialFile> files_;
    std::vector<MerlHeader> headers_;  // of each, when it was first opened
    mutable BadSamples bad_;
};

}  // namespace

std::unique_ptr<Database> open_merl_directory(const std::filesystem::path& directory,
                                              const OpenOptions& options) {
    return std::make_unique<MerlDatabase>(
        directory, "MERL directory", list_database_files(directory, kExtension, options.materials),
        options);
}

std::vector<MaterialFile> list_merl_files(const std::filesystem::path& path) {
    std::error_code none;
    if (std::filesystem::is_directory(path, none)) {
        return list_material_files(path, kExtension);
    }
    read_merl_header(path);  // throws unless it is a MERL file
    return {MaterialFile(path)};
}

std::unique_ptr<Database> open_merl_file(const std::filesystem::path& path,
                                         const OpenOptions& options) {
    return std::make_unique<MerlDatabase>(path, "MERL file", std::vector{MaterialFile(path)},
                                          options);
}

}  // namespace merl::engine
