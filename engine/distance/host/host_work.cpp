#include "engine/distance/host/host_work.h"

#include <tbb/parallel_for.h>

#include <algorithm>

#include "engine/distance/host/host_grid.h"

namespace merl::engine {

HostWork::HostWork(const SlabPlan& plan, const Metric& metric, std::uint64_t grid_voxels)
    : metric_(&metric),
      tiles_(plan.tiles(metric)),
      materials_(plan.materials),
      totals_(metric, plan.materials, tiles_, grid_voxels, kHostRoundings),
      weights_(plan.slab_blocks),
      grid_(std::size_t{plan.slab_blocks} * plan.materials),
      ranges_(metric.has_slopes() ? grid_.size() : 0),
      differences_(plan.sums_bytes(metric) / sizeof(float)),
      slopes_(metric.has_slopes() ? differences_.size() : 0),
      norms_(plan.norms_bytes(metric) / sizeof(float)) {}

void HostWork::weigh(const Slab& slab) {
    fold_weights(*metric_, slab, weights_);
}

void HostWork::make_grid(const Slab& slab, std::size_t material,
                         std::span<const BlockSamples> blocks) {
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        const std::size_t at = block * materials_ + material;
        engine::make_grid(*metric_, slab.voxels_of_block(block), slab.filled(block),
                          weights_[block], blocks[block], grid_[at]);
        if (metric_->has_slopes()) {
            find_ranges(grid_[at], ranges_[at]);
        }
        if (metric_->has_norms()) {
            norms_[block * tiles_.padded_materials() + material] =
                sum_norm(metric_->header.degree, grid_[at]);
        }
    }
}

void HostWork::sum(const Slab& slab) {
    const auto in_tile = [&](std::uint32_t first) {
        return std::min(tiles_.side, materials_ - first);
    };
    const std::uint64_t tasks = slab.blocks() * tiles_.count();
    tbb::parallel_for(std::uint64_t{0}, tasks, [&](std::uint64_t task) {
        const std::uint64_t block = task / tiles_.count();
        const auto tile = tiles_.place_of(static_cast<std::uint32_t>(task % tiles_.count()));
        const std::size_t first = block * materials_;
        const std::size_t sums = task * tiles_.pairs_of_tile();
        const auto tile_of = [&]<typename T>(const Aligned<T>& materials, std::vector<float>& to) {
            return HostTile<T>{.rows = &materials[first + tile.row],
                               .columns = &materials[first + tile.column],
                               .row_count = in_tile(tile.row),
                               .column_count = in_tile(tile.column),
                               .sums = &to[sums],
                               .stride = tiles_.side};
        };
        sum_differences(metric_->header.degree, tile_of(grid_, differences_));
        if (metric_->has_slopes()) {
            sum_slopes(tile_of(ranges_, slopes_));
        }
    });
}

void HostWork::add(const Slab& slab) {
    totals_.add({.differences = differences_, .slopes = slopes_, .norms = norms_}, slab.blocks());
}

std::uint64_t HostWork::bytes() const {
    return weights_.size() * sizeof(BlockWeights) + grid_.size() * sizeof(BlockScalars) +
           ranges_.size() * sizeof(ChunkRanges) +
           (differences_.size() + slopes_.size() + norms_.size()) * sizeof(float) + totals_.bytes();
}

}  // namespace merl::engine
