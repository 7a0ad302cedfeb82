#include "engine/distance/host/twin_metric.h"

#include <tbb/parallel_for.h>

#if defined(__SSE__)
#include <pmmintrin.h>
#endif

#include <algorithm>
#include <cmath>
#include <limits>

namespace merl::engine {
namespace {

/// While it lives, numbers too small for float32's range count as 0 on this thread. They add
/// nothing, and processors take a hundred times as long for them.
class SmallIsZero {
#if defined(__SSE__)
  public:
    SmallIsZero() {
        _mm_setcsr(before_ | _MM_FLUSH_ZERO_ON | _MM_DENORMALS_ZERO_ON);
    }
    ~SmallIsZero() {
        _mm_setcsr(before_);
    }
    SmallIsZero(const SmallIsZero&) = delete;
    SmallIsZero& operator=(const SmallIsZero&) = delete;

  private:
    unsigned before_ = _mm_getcsr();
#endif
};

}  // namespace

TwinMetric::TwinMetric(const Metric& metric, const PairList& pairs, std::uint32_t slab_blocks,
                       std::uint64_t grid_voxels)
    : metric_(&metric),
      pairs_(&pairs),
      grid_voxels_(grid_voxels),
      weights_(slab_blocks),
      grid_(std::size_t{slab_blocks} * pairs.materials()),
      sums_(slab_blocks * pairs.size()),
      totals_(pairs.size()) {}

std::uint64_t TwinMetric::block_bytes(const PairList& pairs) {
    return sizeof(SingleWeights) + pairs.materials() * sizeof(BlockScalars) +
           pairs.size() * sizeof(double);
}

std::uint64_t TwinMetric::fixed_bytes(const PairList& pairs) {
    return pairs.size() * sizeof(CompensatedSum);
}

void TwinMetric::weigh(const Slab& slab) {
    tbb::parallel_for(std::uint64_t{0}, slab.blocks(), [&](std::uint64_t block) {
        BlockWeights weights;
        weigh_block(*metric_, slab, block, weights);
        std::ranges::transform(weights, weights_[block].begin(),
                               [](double weight) { return static_cast<float>(weight); });
    });
}

void TwinMetric::make_grid(const Slab& slab, std::size_t material,
                           std::span<const BlockSamples> blocks) {
    BlockWeights ones;
    ones.fill(1);
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        metric_->twin.scale(metric_->parameters, slab.voxels_of_block(block), blocks[block], ones,
                            grid_[block * pairs_->materials() + material]);
    }
}

void TwinMetric::sum(const Slab& slab) {
    const std::uint64_t materials = pairs_->materials();
    tbb::parallel_for(std::uint64_t{0}, slab.blocks() * materials, [&](std::uint64_t task) {
        const std::uint64_t block = task / materials;
        const auto row = static_cast<std::uint32_t>(task % materials);
        const BlockScalars* const of_block = &grid_[block * materials];
        const SmallIsZero small_is_zero;
        double* const sums = &sums_[block * totals_.size()];
        for (std::size_t pair = pairs_->begin_of(row); pair < pairs_->end_of(row); ++pair) {
            sums[pair] =
                metric_->twin.sum_in_float32(metric_->parameters, of_block[row],
                                             of_block[pairs_->second(row, pair)], weights_[block]);
        }
    });
}

void TwinMetric::add(const Slab& slab) {
    for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
        for (std::size_t pair = 0; pair < totals_.size(); ++pair) {
            totals_[pair].add(sums_[block * totals_.size() + pair]);
        }
    }
}

MetricDistances TwinMetric::distances() const {
    MetricDistances result;
    result.values.resize(totals_.size());
    std::ranges::transform(totals_, result.values.begin(), [&](const CompensatedSum& sum) {
        return std::sqrt(sum.total() / static_cast<double>(grid_voxels_));
    });
    result.bounds.assign(totals_.size(), std::numeric_limits<double>::infinity());
    return result;
}

}  // namespace merl::engine
