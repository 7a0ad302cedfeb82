#pragma once

#include <tbb/cache_aligned_allocator.h>

#include <cstdint>
#include <span>
#include <vector>

#include "engine/distance/host/host_difference.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/distance/parts/slab.h"

namespace merl::engine {

/// One metric with a twin and a degree on the processor, in float32 with its error bound: its grid,
/// and then the sums of a slab.
class HostMetric {
  public:
    /// The pairs outlive it.
    HostMetric(const Metric& metric, const PairList& pairs, std::uint32_t slab_blocks,
               std::uint64_t grid_voxels);

    /// The bytes of memory of that for each block of a slab, and of its totals.
    static std::uint64_t block_bytes(const Metric& metric, const PairList& pairs);
    static std::uint64_t fixed_bytes(const Metric& metric, const PairList& pairs);

    /// The weights of a slab, before make_grid().
    void weigh(const Slab& slab);

    /// One material's part of the grid. Any thread may call it.
    void make_grid(const Slab& slab, std::size_t material, std::span<const BlockSamples> blocks);

    /// The sums of the slab, on all threads.
    void sum(const Slab& slab);

    /// Adds them to the totals.
    void add(const Slab& slab);

    /// After the last slab.
    MetricDistances distances() const { return totals_.distances(); }

  private:
    template <typename T>
    using Aligned = std::vector<T, tbb::cache_aligned_allocator<T>>;

    const Metric* metric_;
    PairTiles tiles_;
    std::uint32_t materials_;
    PairTotals totals_;
    std::vector<BlockWeights> weights_;
    Aligned<BlockScalars> grid_;      // [block][material]
    Aligned<ChunkRanges> ranges_;     // likewise, where the metric has_slopes()
    std::vector<float> differences_;  // [block][tile][row][column]
    std::vector<float> slopes_;       // likewise
    std::vector<float> norms_;        // [block][padded material], where it has_norms()
};

}  // namespace merl::engine
