#include "engine/database/database.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

bool is_name_of_file(std::string_view name) {
    return !name.empty() && name.front() != '.' &&
           name.find_first_of(std::string_view("/\0", 2)) == std::string_view::npos;
}

/// Throws InputError unless the parts have all materials, one after the other, under their labels.
void require_parts(const Database& database) {
    std::size_t next = 0;
    for (const auto& part : database.parts()) {
        for (std::size_t m = part.first; m < part.first + part.materials; ++m) {
            if (m != next++ || m >= database.materials().size() ||
                !database.materials()[m].starts_with(part.label + '/')) {
                throw InputError(
                    fmt::format("{}: material {} is not \"{}/…\", as the parts of the database say",
                                database.name(), m, part.label));
            }
        }
    }
    if (!database.parts().empty() && next != database.materials().size()) {
        throw InputError(fmt::format("{}: its parts have {} materials; it has {}", database.name(),
                                     next, database.materials().size()));
    }
}

}  // namespace

void require_usable(const Grid& grid, const std::string& database) {
    for (const auto side : {grid.theta_h, grid.theta_d, grid.phi_d}) {
        if (side < 1 || side > kMaxSide) {
            throw InputError(fmt::format("{}: the grid is {}; expected 1 to {} voxels a side",
                                         database, grid.text(), kMaxSide));
        }
    }
    if (grid.voxels() > kMaxVoxels) {
        throw InputError(fmt::format("{}: the grid is {}; expected at most {} voxels", database,
                                     grid.text(), kMaxVoxels));
    }
}

void require_usable(const Database& database) {
    require_usable(database.grid(), database.name());
    require_parts(database);
    const std::string* before = nullptr;
    for (const auto& material : database.materials()) {
        const std::size_t label = database.parts().empty() ? 0 : material.find('/') + 1;
        if (!is_name_of_file(std::string_view(material).substr(label))) {
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

void Database::add_skipped(const std::vector<BadMaterial>& skipped) {
    skipped_.insert(skipped_.end(), skipped.begin(), skipped.end());
    std::ranges::sort(skipped_, {}, &BadMaterial::material);
}

std::string Database::place_of([[maybe_unused]] std::size_t material) const {
    return path_.empty() ? name_ : path_;
}

std::string file_stem(std::string_view material) {
    std::string stem(material);
    std::ranges::replace(stem, '/', '=');
    return stem;
}

std::vector<std::string> own_names(const Database& database, const DatabasePart& part) {
    std::vector<std::string> names;
    for (std::size_t m = part.first; m < part.first + part.materials; ++m) {
        names.push_back(database.materials().at(m).substr(part.label.size() + 1));
    }
    return names;
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
