#include "engine/distance/pair_distance.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "engine/distance/float64_distances.h"
#include "engine/distance/host/float64_difference.h"
#include "engine/distance/parts/compensated_sum.h"
#include "engine/distance/parts/window_check.h"

namespace merl::engine {
namespace {

/// Blocks of a slab: what is read at a time (block_reader.cpp) stays in cache.
constexpr std::uint64_t kSlabBlocks = 8;

/// Below this a sum may have lost digits, and float64_distances() scales samples.
constexpr double kSmallestSum = 0x1p-900;

/// The sums of a block as float64_distances() has them: of each channel, or without a degree one of
/// all and zeros.
std::array<double, 3> sums_of_channels(const Metric& metric, const BlockSamples& a,
                                       const BlockSamples& b, const BlockWeights& weights) {
    std::array<double, 3> sums = {};
    if (!metric.has_degree()) {
        sums[0] = metric.twin.sum(metric.parameters, a, b, weights);
        return sums;
    }
    for (std::size_t channel = 0; channel < sums.size(); ++channel) {
        const ChannelSamples* const column = &b[channel];
        sum_float64_differences(metric.header.degree, a[channel], {&column, 1}, weights,
                                std::span(sums).subspan(channel, 1));
    }
    return sums;
}

}  // namespace

KeptGeometry::KeptGeometry(const Grid& grid) : domain(grid), list(domain, VoxelSet::above_horizon) {
    constexpr std::uint64_t kVoxels = kSlabBlocks * kBlockVoxels;
    for (std::uint64_t first = 0; first < list.size(); first += kVoxels) {
        slabs.emplace_back(domain, list, first, std::min(first + kVoxels, list.size()));
    }
}

PairDistance::PairDistance(Metric metric, std::shared_ptr<const KeptGeometry> geometry)
    : metric_(std::move(metric)), geometry_(std::move(geometry)) {
    if (metric_.twin.sum == nullptr) {
        throw std::invalid_argument(metric_.name + " has no sum over voxels in float64");
    }
    const Grid& grid = geometry_->domain.grid();
    refuse_empty_windows(metric_, empty_windows(metric_, grid), grid);
    weights_.resize(block_count(geometry_->list.size()));
    tbb::parallel_for(std::size_t{0}, geometry_->slabs.size(), [&](std::size_t s) {
        const Slab& slab = geometry_->slabs[s];
        for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
            weigh_block(metric_, slab, block, weights_[s * kSlabBlocks + block]);
        }
    });
}

double PairDistance::operator()(const Database& database, MaterialPair pair) const {
    if (database.grid() != geometry_->domain.grid()) {
        throw std::invalid_argument("distances are prepared for " +
                                    geometry_->domain.grid().text() + ", not for " +
                                    database.grid().text());
    }
    std::vector<std::array<double, 3>> sums(weights_.size());  // of each block's channels
    tbb::parallel_for(std::size_t{0}, geometry_->slabs.size(), [&](std::size_t s) {
        const Slab& slab = geometry_->slabs[s];
        const VoxelRange file = {slab.runs.front().file_index,
                                 slab.runs.back().file_index + slab.runs.back().length};
        thread_local std::array<std::vector<BlockSamples>, 2> samples;
        thread_local std::array<BlockSamples, 2> grids;
        const std::array materials = {pair.first, pair.second};
        for (std::size_t i = 0; i < materials.size(); ++i) {
            samples[i].resize(slab.blocks());
            read_blocks(database, materials[i], file, slab.runs, samples[i]);
        }
        for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
            for (std::size_t i = 0; i < materials.size(); ++i) {
                metric_.twin.transform(metric_.parameters, slab.voxels_of_block(block),
                                       samples[i][block], grids[i]);
            }
            const std::uint64_t place = s * kSlabBlocks + block;
            sums[place] = sums_of_channels(metric_, grids[0], grids[1], weights_[place]);
        }
    });
    CompensatedSum sum;
    for (const auto& of_block : sums) {
        for (const double of_channel : of_block) {
            sum.add(of_channel);
        }
    }
    const double distance = std::sqrt(sum.total() / static_cast<double>(database.grid().voxels()));
    if (metric_.header.degree >= 1 &&
        distance < std::sqrt(kSmallestSum / static_cast<double>(database.grid().voxels()))) {
        return float64_distances(database, metric_, {&pair, 1}).front();
    }
    return distance;
}

}  // namespace merl::engine
