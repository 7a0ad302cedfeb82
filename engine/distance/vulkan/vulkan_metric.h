#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "engine/device/buffer.h"
#include "engine/device/context.h"
#include "engine/device/kernel.h"
#include "engine/device/paced_work.h"
#include "engine/device/submission.h"
#include "engine/distance/parts/engine.h"
#include "engine/distance/parts/pair_totals.h"
#include "engine/distance/parts/slab.h"
#include "engine/metric/check/finding.h"
#include "engine/metric/metric.h"
#include "engine/metric/metric_kernels.h"

namespace merl::engine {

/// What difference.comp is off by where its numbers are these (docs/numerics.md). The power:
/// shaders/lib/numerics.glsl; tests/engine/device/device_test.cpp and
/// tests/engine/distance/vulkan/vulkan_metric_test.cpp.
Roundings shader_roundings(const device::FloatControls& floats);

/// How much the device holds at a time.
struct DeviceExtent {
    const PairList* pairs = nullptr;
    std::uint32_t slab_blocks = 0;
    device::TileSides tiles = {};  // of the device

    std::uint32_t materials() const { return pairs->materials(); }
    PairTiles tiles_of(const Metric& metric) const {
        return PairTiles::best(*pairs, metric, tiles);
    }

    std::uint64_t slab_voxels() const { return std::uint64_t{slab_blocks} * kBlockVoxels; }

    // Sizes of the buffers in bytes, of a metric that is no summary. Samples and geometry are there
    // for each slab in flight, sums and norms for each metric and slab in flight (sums twice where
    // there are slopes); weights, grid and ranges are shared by all. Without float64 on the device
    // there are no samples, geometry and weights there, and a grid for each metric and slab in
    // flight. The places of a metric's tiles are there once, however large slabs are.
    std::uint64_t samples_bytes() const { return slab_voxels() * materials() * 3 * sizeof(double); }
    std::uint64_t geometry_bytes() const { return slab_voxels() * sizeof(Voxel); }
    std::uint64_t weights_bytes() const { return slab_voxels() * sizeof(double); }
    std::uint64_t grid_bytes(const Metric& metric) const;
    std::uint64_t ranges_bytes(const Metric& metric) const;
    std::uint64_t norms_bytes(const Metric& metric) const;
    std::uint64_t sums_bytes(const Metric& metric) const;
    std::uint64_t places_bytes(const Metric& metric) const;  // and of the pairs that are checked
};

/// What the metrics need of a device with these limits: EngineNeeds as Engine::needs() has them.
EngineNeeds device_needs(const device::Limits& limits, std::span<const Metric* const> metrics,
                         const PairList& pairs);

/// A slab in flight, as it was read.
struct SlabBuffers {
    SlabBuffers(device::Context& context, const DeviceExtent& extent);

    device::Buffer samples;   // float64 [material][block][channel][voxel of the block]
    device::Buffer geometry;  // Voxel [voxel]
};

/// Device memory that all metrics and slabs use one after the other.
struct ScratchBuffers {
    ScratchBuffers(device::Context& context, const DeviceExtent& extent,
                   std::span<const Metric* const> metrics);

    /// Where the device makes the grids: the weight volume of a slab, and the grid of a metric,
    /// [block][material][texel].
    std::optional<device::Buffer> weights, grid;
    std::optional<device::Buffer> ranges;  // [block][material][chunk], where a metric has slopes
};

/// One metric on the device: its kernels (shaders/framework/), and the float64 totals of what they
/// give.
class VulkanMetric {
  public:
    /// Compiles the metric: throws what compile_kernels() throws.
    VulkanMetric(device::Context& context, const DeviceExtent& extent, const Metric& metric,
                 std::uint64_t grid_voxels);

    const Metric& metric() const { return *metric_; }

    /// Buffers of one slab in flight, and the kernels bound to them.
    class Products {
      public:
        /// `slab` is there where the device makes the grids.
        Products(device::Context& context, VulkanMetric& work, SlabBuffers* slab,
                 ScratchBuffers& scratch);

      private:
        friend class VulkanMetric;
        double grid_units_ = 0;  // of work that was recorded
        double pair_units_ = 0;
        std::optional<device::Buffer> grid_;    // where the host makes it
        device::Buffer sums_;                   // [block][tile][row][column]
        std::optional<device::Buffer> slopes_;  // likewise, with has_slopes()
        std::optional<device::Buffer> norms_;   // [block][material], with has_norms()
        std::optional<device::Buffer> finding_;
        std::optional<device::BoundKernel> weigh_, prepare_, difference_, diagonal_difference_;
        std::optional<device::BoundKernel> norm_, range_, slope_, diagonal_slope_;
        std::optional<device::BoundKernel> check_, degree_;
    };

    /// Bytes of memory beside that of the device.
    std::uint64_t host_bytes() const { return weights_.size() * sizeof(BlockWeights); }

    /// Where the host makes the grids (Limits::floats): what the samples of a slab are weighted
    /// with, and then one material's part of the grid, which any thread may make.
    void weigh(const Slab& slab);
    void make_grid(const Products& products, const Slab& slab, std::size_t material,
                   std::span<const BlockSamples> blocks) const;

    /// The places of the tiles, and the grid where the host makes it; before record().
    void upload(device::Submission& submission, const Products& products);

    /// Records everything for a slab of `voxels` voxels, filled up to `blocks` blocks. Marks twice:
    /// after the grid is made, and after the differences.
    void record(device::PacedWork& work, Products& products, std::uint32_t voxels,
                std::uint32_t blocks);

    /// The seconds up to either mark of a slab that is finished: what comes next is cut by them.
    void measured(const Products& products, double grid_seconds, double pair_seconds);

    /// Adds the sums of a slab to the totals, each pair's in the order of the blocks.
    void add(const Products& products, std::uint32_t blocks);

    /// What kernels found wrong in a slab that is finished; nullptr when nothing is.
    static const Finding* finding(const Products& products);

    /// The distances, after the last slab.
    MetricDistances distances() const { return totals_.distances(); }

  private:
    VulkanMetric(device::Context& context, const DeviceExtent& extent, const Metric& metric,
                 std::uint64_t grid_voxels, const MetricKernels& spirv);

    const Metric* metric_;
    DeviceExtent extent_;
    PairTiles tiles_;
    PairTotals totals_;
    std::vector<MaterialPair> checked_;  // pairs that check.comp looks at
    device::Buffer places_;              // of the tiles, PairTiles::Place [tile], and these
    bool knows_degree_ = false;          // whether degree.comp was recorded
    bool has_places_ = false;            // the device
    device::WorkBudget grid_budget_;     // in blocks of a material
    device::WorkBudget pair_budget_;     // in blocks of a pair
    std::vector<BlockWeights> weights_;  // where the host makes the grids
    std::uint32_t subgroup_size_;
    std::optional<device::Kernel> weigh_, prepare_;
    std::optional<device::Kernel> difference_, diagonal_difference_;
    std::optional<device::Kernel> norm_, range_, slope_, diagonal_slope_, check_, degree_;
};

}  // namespace merl::engine
