#include "engine/database/database.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"

namespace merl::engine {

void require_usable(const Database& database) {
    const Grid& grid = database.grid();
    for (const auto side : {grid.theta_h, grid.theta_d, grid.phi_d}) {
        if (side < 1 || side > kMaxSide) {
            throw InputError(fmt::format("{}: the grid is {}; expected 1 to {} voxels a side",
                                         database.name(), grid.text(), kMaxSide));
        }
    }
    if (grid.voxels() > kMaxVoxels) {
        throw InputError(fmt::format("{}: the grid is {}; expected at most {} voxels",
                                     database.name(), grid.text(), kMaxVoxels));
    }
    const std::string* before = nullptr;
    for (const auto& material : database.materials()) {
        if (material.empty() || material.front() == '.' ||
            material.find_first_of(std::string_view("/\0", 2)) != std::string::npos) {
            throw InputError(
                fmt::format("{}: a material is called \"{}\"; names become names of files, so they "
                            "are not empty, begin with no dot and hold no slash",
                            database.name(), material));
        }
        if (before != nullptr && *before >= material) {
            throw InputError(
                fmt::format("{}: the material \"{}\" comes after \"{}\"; expected different names, "
                            "ascending bytewise",
                            database.name(), material, *before));
        }
        before = &material;
    }
}

void read_material(
    const Database& database, std::size_t material, const SampleSink& sink,
    const std::function<void(VoxelRange range, std::span<const double> samples)>& use) {
    constexpr std::uint64_t kVoxelsAtATime = 16384;  // whose planes stay in cache
    const std::uint64_t voxels = database.grid().voxels();
    std::vector<double> samples(3 * std::min(kVoxelsAtATime, voxels));
    for (std::uint64_t first = 0; first < voxels; first += kVoxelsAtATime) {
        const VoxelRange range = {first, std::min(first + kVoxelsAtATime, voxels)};
        const auto planes = std::span(samples).first(3 * range.size());
        database.read(material, range, planes, sink);
        use(range, planes);
    }
}

}  // namespace merl::engine
