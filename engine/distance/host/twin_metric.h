#pragma once

#include <tbb/cache_aligned_allocator.h>

#include <cstdint>
#include <span>
#include <vector>

#include "engine/distance/parts/compensated_sum.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/distance/parts/slab.h"

namespace merl::engine {

/// One metric with a twin and no degree on the processor: transformed in float64, its differences
/// in float32, their sum in float64. Nothing is known of the errors of its distances.
class TwinMetric {
  public:
    /// The pairs outlive it.
    TwinMetric(const Metric& metric, const PairList& pairs, std::uint32_t slab_blocks,
               std::uint64_t grid_voxels);

    /// The bytes of memory of that for each block of a slab, and of its totals.
    static std::uint64_t block_bytes(const PairList& pairs);
    static std::uint64_t fixed_bytes(const PairList& pairs);

    /// The weights of a slab.
    void weigh(const Slab& slab);

    /// The transformed samples of one material. Any thread may call it.
    void make_grid(const Slab& slab, std::size_t material, std::span<const BlockSamples> blocks);

    /// The sums of the slab, on all threads.
    void sum(const Slab& slab);

    /// Adds them to the totals.
    void add(const Slab& slab);

    /// After the last slab.
    MetricDistances distances() const;

  private:
    const Metric* metric_;
    const PairList* pairs_;
    std::uint64_t grid_voxels_;
    template <typename T>
    using Aligned = std::vector<T, tbb::cache_aligned_allocator<T>>;

    Aligned<SingleWeights> weights_;
    Aligned<BlockScalars> grid_;          // [block][material]
    std::vector<double> sums_;            // [block][pair]
    std::vector<CompensatedSum> totals_;  // [pair]
};

}  // namespace merl::engine
