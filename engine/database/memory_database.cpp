#include "engine/database/memory_database.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

std::vector<std::vector<double>> samples_of(const Grid& grid, std::size_t materials,
                                            const MemoryDatabase::Sample& sample) {
    std::vector<std::vector<double>> samples(materials);
    for (std::size_t material = 0; material < materials; ++material) {
        samples[material].reserve(3 * grid.voxels());
        for (std::size_t channel = 0; channel < 3; ++channel) {
            for (std::uint64_t voxel = 0; voxel < grid.voxels(); ++voxel) {
                samples[material].push_back(sample(material, voxel, channel));
            }
        }
    }
    return samples;
}

}  // namespace

MemoryDatabase::MemoryDatabase(std::string name, const Grid& grid,
                               std::vector<std::string> materials,
                               std::vector<std::vector<double>> samples)
    : Database(std::move(name), "in memory"), samples_(std::move(samples)) {
    grid_ = grid;
    materials_ = std::move(materials);
    if (samples_.size() != materials_.size()) {
        throw InputError(fmt::format("{}: samples of {} materials; expected those of {}", name_,
                                     samples_.size(), materials_.size()));
    }
    require_usable(*this);
    for (std::size_t m = 0; m < materials_.size(); ++m) {
        if (samples_[m].size() != 3 * grid.voxels()) {
            throw InputError(fmt::format("{}: {} has {} numbers; expected {}, three planes of {}",
                                         name_, materials_[m], samples_[m].size(),
                                         3 * grid.voxels(), grid.text()));
        }
        const auto bad = std::ranges::find_if(samples_[m], [](double value) {
            return !std::isfinite(value) || value > kMaxReflectance;
        });
        if (bad != samples_[m].end()) {
            throw InputError(fmt::format(
                "{}: number {} of {} is {}/sr; expected a finite number, "
                "at most {}",
                name_, bad - samples_[m].begin(), materials_[m], *bad, kMaxReflectance));
        }
    }
}

MemoryDatabase::MemoryDatabase(std::string name, const Grid& grid,
                               std::vector<std::string> materials, const Sample& sample)
    : MemoryDatabase(std::move(name), grid, materials, samples_of(grid, materials.size(), sample)) {
}

void MemoryDatabase::read(std::size_t material, VoxelRange range, std::span<double> samples,
                          const SampleSink& sink) const {
    const auto& of_material = samples_.at(material);
    for (std::size_t plane = 0; plane < 3; ++plane) {
        const auto from =
            std::span(of_material).subspan(plane * grid_.voxels() + range.first, range.size());
        std::ranges::copy(from,
                          samples.begin() + static_cast<std::ptrdiff_t>(plane * range.size()));
        if (sink) {
            sink(plane, std::as_bytes(from));
        }
    }
}

}  // namespace merl::engine
