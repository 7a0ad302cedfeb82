#include "engine/database/merl_directory.h"

#include <fmt/format.h>

#include <system_error>

#include "engine/base/error.h"
#include "engine/database/merl_file.h"

namespace merl::engine {
namespace {

constexpr const char* kExtension = ".binary";

class MerlDatabase final : public Database {
  public:
    /// `name` is what it is called and where it is.
    MerlDatabase(const std::filesystem::path& name, const char* kind,
                 std::vector<MaterialFile> files)
        : Database(name.string(), kind,
                   std::filesystem::absolute(name).lexically_normal().string()),
          files_(std::move(files)) {
        for (const auto& file : files_) {
            const auto& header = headers_.emplace_back(read_merl_header(file.path));
            const Grid& grid = header.grid;
            if (materials_.empty()) {
                grid_ = grid;
            } else if (grid != grid_) {
                throw InputError(fmt::format(
                    "{}: the grid is {}; {} has {}, and all files of a database must have the same",
                    file.path.string(), grid.text(), files_.front().path.string(), grid_.text()));
            }
            materials_.push_back(file.material);
        }
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        read_merl_samples(files_.at(material).path, headers_.at(material), range, samples, sink);
    }

  private:
    std::vector<MaterialFile> files_;
    std::vector<MerlHeader> headers_;  // of each, when it was first opened
};

}  // namespace

std::unique_ptr<Database> open_merl_directory(const std::filesystem::path& directory,
                                              const WantedMaterials& wanted) {
    return std::make_unique<MerlDatabase>(directory, "MERL directory",
                                          list_database_files(directory, kExtension, wanted));
}

std::vector<MaterialFile> list_merl_files(const std::filesystem::path& path) {
    std::error_code none;
    if (std::filesystem::is_directory(path, none)) {
        return list_material_files(path, kExtension);
    }
    read_merl_header(path);  // throws unless it is a MERL file
    return {MaterialFile(path)};
}

std::unique_ptr<Database> open_merl_file(const std::filesystem::path& path) {
    return std::make_unique<MerlDatabase>(path, "MERL file", std::vector{MaterialFile(path)});
}

}  // namespace merl::engine
