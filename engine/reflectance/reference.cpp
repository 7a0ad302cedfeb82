#include "engine/reflectance/reference.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>
#include <map>

namespace merl::reflectance {
namespace {

/// Blocks whose sums are held at a time, before they are added to the totals in order.
constexpr std::uint64_t kBlocksAtATime = 64;

/// The samples of one material at the voxels of `runs`, transformed.
std::vector<Rgb> transformed(const Database& database, const Domain& domain, const Metric& metric,
                             std::uint32_t material, std::span<const VoxelRun> runs) {
    const VoxelRange file = {runs.front().file_index, runs.back().file_index + runs.back().length};
    std::vector<double> samples(3 * file.size());
    database.read(material, file, samples);
    std::vector<Rgb> result;
    for (const auto& run : runs) {
        for (std::uint64_t i = run.file_index; i < run.file_index + run.length; ++i) {
            Rgb rgb;
            for (std::size_t plane = 0; plane < 3; ++plane) {
                rgb[plane] = std::max(0.0, samples[plane * file.size() + (i - file.first)]);
            }
            result.push_back(metric.twin.transform(rgb, domain.voxel(i)));
        }
    }
    return result;
}

}  // namespace

std::vector<double> reference_distances(const Database& database, const Metric& metric,
                                        std::span<const MaterialPair> pairs, VoxelSet set) {
    const Domain domain(database.grid());
    const VoxelList voxels(domain, set);
    const std::uint64_t blocks = (voxels.size() + kBlockVoxels - 1) / kBlockVoxels;
    std::vector<double> totals(pairs.size());
    std::vector<std::vector<double>> sums(kBlocksAtATime, std::vector<double>(pairs.size()));
    for (std::uint64_t first = 0; first < blocks; first += kBlocksAtATime) {
        const std::uint64_t count = std::min(kBlocksAtATime, blocks - first);
        tbb::parallel_for(std::uint64_t{0}, count, [&](std::uint64_t i) {
            const std::uint64_t from = (first + i) * kBlockVoxels;
            const auto runs = voxels.runs(from, std::min(from + kBlockVoxels, voxels.size()));
            std::vector<double> weights;
            for (const auto& run : runs) {
                for (std::uint64_t j = 0; j < run.length; ++j) {
                    weights.push_back(metric.twin.weight(domain.voxel(run.file_index + j)));
                }
            }
            std::map<std::uint32_t, std::vector<Rgb>> grids;
            const auto grid = [&](std::uint32_t material) -> const std::vector<Rgb>& {
                auto& entry = grids[material];
                if (entry.empty()) {
                    entry = transformed(database, domain, metric, material, runs);
                }
                return entry;
            };
            for (std::size_t p = 0; p < pairs.size(); ++p) {
                sums[i][p] = metric.twin.sum(grid(pairs[p].first), grid(pairs[p].second), weights);
            }
        });
        for (std::uint64_t i = 0; i < count; ++i) {
            for (std::size_t p = 0; p < pairs.size(); ++p) {
                totals[p] += sums[i][p];
            }
        }
    }
    for (double& total : totals) {
        total = std::sqrt(total / static_cast<double>(database.grid().voxels()));
    }
    return totals;
}

}  // namespace merl::reflectance
