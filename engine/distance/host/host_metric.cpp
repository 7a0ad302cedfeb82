#include "engine/distance/host/host_metric.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "engine/distance/parts/twin_grid.h"

namespace merl::engine {
namespace {

/// Materials along a side of a tile: as many blocks of them as stay in the processor's nearest
/// caches.
constexpr std::uint32_t kTile = 20;
static_assert(kTile % kHostGroup == 0);

PairTiles tiles_of(const PairList& pairs) {
    return PairTiles::covering(pairs, kTile);
}

std::size_t sums_of_block(const PairTiles& tiles) {
    return tiles.count() * tiles.pairs_of_tile();
}

}  // namespace

HostMetric::HostMetric(const Metric& metric, const PairList& pairs, std::uint32_t slab_blocks,
                       std::uint64_t grid_voxels)
    : metric_(&metric),
      tiles_(tiles_of(pairs)),
      materials_(pairs.materials()),
      totals_(metric, tiles_, grid_voxels, kHostRoundings),
      weights_(slab_blocks),
      grid_(std::size_t{slab_blocks} * materials_),
      ranges_(metric.has_slopes() ? grid_.size() : 0),
      differences_(slab_blocks * sums_of_block(tiles_)),
      slopes_(metric.has_slopes() ? differences_.size() : 0),
      norms_(metric.has_norms() ? std::size_t{slab_blocks} * tiles_.padded_materials() : 0) {}

std::uint64_t HostMetric::block_bytes(const Metric& metric, const PairList& pairs) {
    const auto tiles = tiles_of(pairs);
    const std::uint64_t grid =
        sizeof(BlockScalars) + (metric.has_slopes() ? sizeof(ChunkRanges) : 0);
    const std::uint64_t sums = (metric.has_slopes() ? 2 : 1) * sums_of_block(tiles) +
                               (metric.has_norms() ? tiles.padded_materials() : 0);
    return sizeof(BlockWeights) + pairs.materials() * grid + sums * sizeof(float);
}

std::uint64_t HostMetric::fixed_bytes(const Metric& metric, const PairList& pairs) {
    return PairTotals::bytes(metric, tiles_of(pairs));
}

void HostMetric::weigh(const Slab& slab) {
    fold_weights(*metric_, slab, weights_);
}

void HostMetric::make_grid(const Slab& slab, std::size_t material,
                           std::span<const BlockSamples> blocks) {
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        const std::size_t at = block * materials_ + material;
        make_scalars(*metric_, slab, block, weights_[block], blocks[block], grid_[at]);
        if (metric_->has_slopes()) {
            find_ranges(grid_[at], ranges_[at]);
        }
        if (metric_->has_norms()) {
            norms_[block * tiles_.padded_materials() + material] =
                sum_norm(metric_->header.degree, grid_[at]);
        }
    }
}

void HostMetric::sum(const Slab& slab) {
    const std::uint32_t rows = tiles_.pairs->rows() > 0 ? tiles_.pairs->rows() : materials_;
    const std::uint64_t tasks = slab.blocks() * tiles_.count();
    tbb::parallel_for(std::uint64_t{0}, tasks, [&](std::uint64_t task) {
        const std::uint64_t block = task / tiles_.count();
        const auto tile = tiles_.place_of(task % tiles_.count());
        const std::size_t first = block * materials_;
        const std::size_t sums = task * tiles_.pairs_of_tile();
        const auto tile_of = [&]<typename T>(const Aligned<T>& materials, std::vector<float>& to) {
            return HostTile<T>{.rows = &materials[first + tile.row],
                               .columns = &materials[first + tile.column],
                               .row_count = std::min(tiles_.side, rows - tile.row),
                               .column_count = std::min(tiles_.side, materials_ - tile.column),
                               .sums = &to[sums],
                               .stride = tiles_.side};
        };
        sum_differences(metric_->header.degree, tile_of(grid_, differences_));
        if (metric_->has_slopes()) {
            sum_slopes(tile_of(ranges_, slopes_));
        }
    });
}

void HostMetric::add(const Slab& slab) {
    totals_.add({.differences = differences_, .slopes = slopes_, .norms = norms_}, slab.blocks());
}

}  // namespace merl::engine
