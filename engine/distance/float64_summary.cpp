#include "engine/distance/float64_summary.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "engine/distance/parts/slab.h"

namespace merl::engine {
namespace {

/// Blocks that are read at a time.
constexpr std::uint64_t kBlocksAtATime = 64;

using Sums = std::array<long double, 3>;

std::vector<double> features_of(const Database& database, std::uint32_t material,
                                const Metric& metric, const Domain& domain, const VoxelList& list) {
    const std::size_t windows = metric.header.windows.size();
    std::vector<Sums> samples(windows, Sums{});
    std::vector<Sums> weights(windows, Sums{});
    std::vector<BlockSamples> blocks;
    std::vector<BlockGaps> gaps;
    for (std::uint64_t from = 0; from < list.size(); from += kBlocksAtATime * kBlockVoxels) {
        const Slab slab(domain, list, from,
                        std::min(from + kBlocksAtATime * kBlockVoxels, list.size()));
        const VoxelRange file = {slab.runs.front().file_index,
                                 slab.runs.back().file_index + slab.runs.back().length};
        blocks.resize(slab.blocks());
        read_blocks(database, material, file, slab.runs, blocks, {}, nullptr, &gaps);
        for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
            for (std::uint32_t w = 0; w < windows; ++w) {
                BlockWeights of_window;
                metric.twin.window(metric.parameters, slab.voxels_of_block(block), w, of_window);
                for (std::size_t c = 0; c < 3; ++c) {
                    for (std::uint64_t k = 0; k < slab.filled(block); ++k) {
                        const bool is_measured = gaps.empty() || !gaps[block][c][k];
                        const long double weight = is_measured ? of_window[k] : 0;
                        samples[w][c] += weight * blocks[block][c][k];
                        weights[w][c] += weight;
                    }
                }
            }
        }
    }
    std::vector<WindowMean> means(windows);
    for (std::size_t w = 0; w < windows; ++w) {
        for (std::size_t c = 0; c < 3; ++c) {
            means[w][c] =
                weights[w][c] > 0 ? static_cast<double>(samples[w][c] / weights[w][c]) : 0;
        }
    }
    std::vector<double> features(metric.header.features);
    metric.twin.features(metric.parameters, means, features);
    return features;
}

}  // namespace

std::vector<double> float64_summary_distances(const Database& database,
                                              const Float64Request& request, VoxelSet set) {
    const Domain domain(database.grid());
    const VoxelList list(domain, set);
    std::map<std::uint32_t, std::vector<double>> features;
    std::vector<std::uint32_t> materials;
    for (const auto& [a, b] : request.pairs) {
        for (const auto material : {a, b}) {
            if (features.try_emplace(material).second) {
                materials.push_back(material);
            }
        }
    }
    tbb::parallel_for(std::size_t{0}, materials.size(), [&](std::size_t i) {
        features.at(materials[i]) =
            features_of(database, materials[i], *request.metric, domain, list);
    });
    std::vector<double> distances;
    for (const auto& [a, b] : request.pairs) {
        double sum = 0;
        for (std::size_t i = 0; i < request.metric->header.features; ++i) {
            const double d = features.at(a)[i] - features.at(b)[i];
            sum += d * d;
        }
        distances.push_back(std::sqrt(sum));
    }
    return distances;
}

}  // namespace merl::engine
