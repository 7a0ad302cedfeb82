#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/device/buffer.h"
#include "engine/device/context.h"
#include "engine/device/kernel.h"
#include "engine/device/submission.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/distance/parts/slab_plan.h"
#include "engine/metric/check/finding.h"
#include "engine/metric/metric.h"
#include "engine/metric/metric_kernels.h"

namespace merl::engine {

/// What kernels need that make a grid on the device: samples of a slab in flight.
struct SlabBuffers {
    SlabBuffers(device::Context& context, const SlabPlan& plan);

    device::Buffer samples;   // float64 [material][block][channel][voxel of the block]
    device::Buffer geometry;  // Voxel [voxel]
};

/// Device memory that all metrics and slabs use one after the other.
struct ScratchBuffers {
    ScratchBuffers(device::Context& context, const SlabPlan& plan,
                   std::span<const Metric* const> metrics);

    std::optional<device::Buffer> weights;  // of the voxels, where a grid is made on the device
    std::optional<device::Buffer> grid;     // likewise
    std::optional<device::Buffer> ranges;   // [block][material][chunk], where a metric has slopes
};

/// One metric on the device: its kernels (shaders/framework/), and the float64 totals of what they
/// give.
class DeviceWork {
  public:
    /// Compiles the metric: throws what compile_kernels() throws.
    DeviceWork(device::Context& context, const SlabPlan& plan, const Metric& metric,
               std::uint64_t grid_voxels);

    const Metric& metric() const { return *metric_; }

    /// Buffers of one slab in flight, and the kernels bound to them.
    class Products {
      public:
        /// `slab` is there when a metric of the computation has no twin.
        Products(device::Context& context, const DeviceWork& work, SlabBuffers* slab,
                 ScratchBuffers& scratch);

      private:
        friend class DeviceWork;
        std::optional<device::Buffer> grid_;    // [block][material][texel], made on the host
        std::vector<BlockWeights> weights_;     // for that
        device::Buffer sums_;                   // [block][tile][row][column]
        std::optional<device::Buffer> slopes_;  // likewise, with has_slopes()
        std::optional<device::Buffer> norms_;   // [block][material], with has_norms()
        std::optional<device::Buffer> finding_;
        std::optional<device::BoundKernel> weigh_, prepare_, difference_, diagonal_difference_;
        std::optional<device::BoundKernel> norm_, range_, slope_, diagonal_slope_, check_;
    };

    /// For a metric with a twin: the weights of a slab, before make_grid().
    void weigh(Products& products, const Slab& slab) const;

    /// Likewise: one material's part of the grid. Any thread may call it.
    void make_grid(Products& products, const Slab& slab, std::size_t material,
                   std::span<const BlockSamples> blocks) const;

    /// Records everything for a slab of `voxels` voxels, filled up to `blocks` blocks. Marks twice:
    /// after the grid is made, and after the differences.
    void record(device::Submission& submission, Products& products, std::uint32_t voxels,
                std::uint32_t blocks) const;

    /// Adds the sums of a slab to the totals, each pair's in the order of the blocks.
    void add(const Products& products, std::uint32_t blocks);

    /// What check.comp found wrong in a slab that is finished; nullptr when nothing is.
    static const Finding* finding(const Products& products);

    /// The distances, after the last slab.
    MetricDistances distances() const { return totals_.distances(); }

  private:
    DeviceWork(device::Context& context, const SlabPlan& plan, const Metric& metric,
               std::uint64_t grid_voxels, const MetricKernels& spirv);

    const Metric* metric_;
    SlabPlan plan_;
    PairTiles tiles_;
    PairTotals totals_;
    std::optional<device::Kernel> weigh_, prepare_;  // without a twin
    std::optional<device::Kernel> difference_, diagonal_difference_;
    std::optional<device::Kernel> norm_, range_, slope_, diagonal_slope_, check_;
};

}  // namespace merl::engine
