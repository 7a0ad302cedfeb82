#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "engine/distance/parts/engine.h"
#include "engine/distance/parts/summary.h"

namespace merl::engine {

/// One summary metric with a twin on the processor, in float64: sums over its windows while samples
/// are read, and distances at the end.
class SummaryMetric {
  public:
    /// The pairs of the extent outlive it, and the materials' names.
    SummaryMetric(const Metric& metric, const Extent& extent,
                  std::span<const std::string> materials);

    /// The bytes of memory of that for each block of a slab, and of its totals.
    static std::uint64_t block_bytes(const Metric& metric);
    static std::uint64_t fixed_bytes(const Metric& metric, std::uint32_t materials);

    /// The windows of a slab: once for all materials.
    void weigh(const Slab& slab);

    /// Adds one material's samples. Any thread may call it.
    void add(std::size_t material, std::span<const BlockSamples> blocks,
             std::span<const BlockGaps> gaps);

    /// After the last slab.
    MetricDistances distances() const;

  private:
    /// One window in one block: zero before and after a part of it, which is all that is looked at.
    struct Part {
        std::uint32_t first = 0;  // multiples of kWindowLanes
        std::uint32_t last = 0;
        double weight = 0;  // of all voxels
    };

    const Metric* metric_;
    const PairList* pairs_;
    std::span<const std::string> materials_;
    WindowTotals totals_;
    std::vector<BlockWeights> weights_;  // [block][window]
    std::vector<Part> parts_;            // likewise
};

}  // namespace merl::engine
