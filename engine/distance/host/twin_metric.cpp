#include "engine/distance/host/twin_metric.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

namespace merl::engine {
namespace {

std::size_t pair_count(std::uint32_t materials) {
    return std::size_t{materials} * (materials - 1) / 2;
}

}  // namespace

TwinMetric::TwinMetric(const Metric& metric, std::uint32_t materials, std::uint32_t slab_blocks,
                       std::uint64_t grid_voxels)
    : metric_(&metric),
      materials_(materials),
      grid_voxels_(grid_voxels),
      weights_(slab_blocks),
      grid_(std::size_t{slab_blocks} * materials),
      sums_(slab_blocks * pair_count(materials)),
      totals_(pair_count(materials)) {}

std::uint64_t TwinMetric::block_bytes(std::uint32_t materials) {
    return sizeof(BlockWeights) + materials * sizeof(BlockSamples) +
           pair_count(materials) * sizeof(double);
}

std::uint64_t TwinMetric::fixed_bytes(std::uint32_t materials) {
    return pair_count(materials) * sizeof(double);
}

void TwinMetric::weigh(const Slab& slab) {
    tbb::parallel_for(std::uint64_t{0}, slab.blocks(), [&](std::uint64_t block) {
        weigh_block(*metric_, slab, block, weights_[block]);
    });
}

void TwinMetric::make_grid(const Slab& slab, std::size_t material,
                           std::span<const BlockSamples> blocks) {
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        metric_->twin.transform(metric_->parameters, slab.voxels_of_block(block), blocks[block],
                                grid_[block * materials_ + material]);
    }
}

void TwinMetric::sum(const Slab& slab) {
    const std::uint64_t rows = slab.blocks() * materials_;
    tbb::parallel_for(std::uint64_t{0}, rows, [&](std::uint64_t task) {
        const std::uint64_t block = task / materials_;
        const auto row = static_cast<std::uint32_t>(task % materials_);
        const BlockSamples* const of_block = &grid_[block * materials_];
        double* sum =
            &sums_[block * totals_.size()] + totals_.size() - pair_count(materials_ - row);
        for (std::uint32_t column = row + 1; column < materials_; ++column) {
            *sum++ = metric_->twin.sum(metric_->parameters, of_block[row], of_block[column],
                                       weights_[block]);
        }
    });
}

void TwinMetric::add(const Slab& slab) {
    for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
        const auto of_block = std::span(sums_).subspan(block * totals_.size(), totals_.size());
        std::ranges::transform(totals_, of_block, totals_.begin(), std::plus<>());
    }
}

MetricDistances TwinMetric::distances() const {
    MetricDistances result;
    result.values.resize(totals_.size());
    std::ranges::transform(totals_, result.values.begin(), [&](double total) {
        return std::sqrt(total / static_cast<double>(grid_voxels_));
    });
    result.bounds.assign(totals_.size(), 0.0);
    return result;
}

}  // namespace merl::engine
