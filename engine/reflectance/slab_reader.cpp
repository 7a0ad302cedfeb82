#include "engine/reflectance/slab_reader.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <stdexcept>

namespace merl::reflectance {
namespace {

/// Voxels that one thread reads at a time: three planes of them stay in its second-level cache.
constexpr std::uint64_t kReadVoxels = 16384;

}  // namespace

SlabReader::SlabReader(const Database& database, const Domain& domain, const VoxelList& voxels)
    : database_(database),
      domain_(domain),
      voxels_(voxels),
      counts_(database.materials().size()),
      hash_(database.materials().size()) {}

void SlabReader::read(std::uint64_t first, std::uint64_t last, std::span<double> samples,
                      std::uint64_t stride, std::span<double> geometry) {
    const auto runs = voxels_.runs(first, last);
    const bool final_slab = last == voxels_.size();
    const VoxelRange file = {file_position_, final_slab || runs.empty()
                                                 ? database_.grid().voxels()
                                                 : runs.back().file_index + runs.back().length};
    file_position_ = file.last;
    tbb::parallel_for(std::size_t{0}, counts_.size(), [&](std::size_t material) {
        read_material(material, file, runs, first, samples, stride);
    });
    tbb::parallel_for(std::size_t{0}, runs.size(), [&](std::size_t i) {
        for (std::uint64_t j = 0; j < runs[i].length; ++j) {
            const Voxel v = domain_.voxel(runs[i].file_index + j);
            const std::array<double, kGeometryNumbers> numbers = {
                v.theta_h,     v.theta_d,     v.phi_d,       v.s_merl,
                v.cos_theta_i, v.cos_theta_o, v.solid_angle, v.voxels};
            std::copy(numbers.begin(), numbers.end(),
                      geometry.begin() + static_cast<std::ptrdiff_t>(
                                             (runs[i].position - first + j) * kGeometryNumbers));
        }
    });
}

void SlabReader::read_material(std::size_t material, VoxelRange file,
                               std::span<const VoxelRun> runs, std::uint64_t first,
                               std::span<double> samples, std::uint64_t stride) {
    thread_local std::vector<double> scratch;
    scratch.resize(3 * kReadVoxels);
    auto run = runs.begin();
    std::uint64_t done_of_run = 0;
    MaterialCounts counts;
    const auto negatives = [](const double* r, const double* g, const double* b,
                              std::uint64_t size) {
        std::uint64_t count = 0;
        for (std::uint64_t i = 0; i < size; ++i) {
            count += static_cast<std::uint64_t>((r[i] < 0) | (g[i] < 0) | (b[i] < 0));
        }
        return count;
    };
    for (std::uint64_t at = file.first; at < file.last; at += kReadVoxels) {
        const VoxelRange part = {at, std::min(at + kReadVoxels, file.last)};
        const std::span<double> planes(scratch.data(), 3 * part.size());
        database_.read(material, part, planes, &hash_);
        const double* red = planes.data();
        const double* green = red + part.size();
        const double* blue = green + part.size();
        counts.negative += negatives(red, green, blue, part.size());
        while (run != runs.end() && run->file_index + done_of_run < part.last) {
            const std::uint64_t from = run->file_index + done_of_run - part.first;
            const std::uint64_t length =
                std::min(run->length - done_of_run, part.last - part.first - from);
            counts.negative_above_horizon +=
                negatives(red + from, green + from, blue + from, length);
            for (std::size_t plane = 0; plane < 3; ++plane) {
                const double* in = planes.data() + plane * part.size() + from;
                double* out = samples.data() + (material * 3 + plane) * stride +
                              (run->position - first) + done_of_run;
                for (std::uint64_t i = 0; i < length; ++i) {
                    out[i] = in[i] > 0 ? in[i] : 0.0;
                }
            }
            done_of_run += length;
            if (done_of_run == run->length) {
                ++run;
                done_of_run = 0;
            }
        }
    }
    counts_[material].negative += counts.negative;
    counts_[material].negative_above_horizon += counts.negative_above_horizon;
}

std::string SlabReader::content_hash() const {
    if (file_position_ != database_.grid().voxels()) {
        throw std::logic_error("the content hash was asked for before the whole database was read");
    }
    return hash_.digest(database_.materials(), database_.grid().text());
}

}  // namespace merl::reflectance
