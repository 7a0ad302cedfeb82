#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "engine/distance/parts/summary.h"
#include "engine/distance/vulkan/vulkan_metric.h"

namespace merl::engine {

/// Features of rows of means on the device, in float64. Compiles the kernel for that, and nothing
/// else of the metric; both outlive the result. `meanwhile` is called while it is waited for.
/// Throws what compile_kernels() throws.
Features device_features(device::Context& context, const Metric& metric,
                         const std::function<void()>& meanwhile);

/// One summary metric on the device, in float64: its kernels (shaders/framework/window.comp and
/// those that it names), and the totals of what they give.
class VulkanSummary {
  public:
    /// Compiles the metric: throws what compile_kernels() throws.
    VulkanSummary(device::Context& context, const DeviceExtent& extent, const Metric& metric);

    const Metric& metric() const { return *metric_; }

    /// Bytes of buffers for each block of a slab: of windows, which all slabs use one after the
    /// other, and of what each slab in flight gives.
    static std::uint64_t weights_bytes(const DeviceExtent& extent, const Metric& metric);
    static std::uint64_t parts_bytes(const DeviceExtent& extent, const Metric& metric);
    static std::uint64_t sums_bytes(const DeviceExtent& extent, const Metric& metric);

    /// Of the totals, and of the features at the end.
    static std::uint64_t fixed_bytes(const Metric& metric, std::uint32_t materials);

    /// Buffers of one slab in flight, and the kernels bound to them.
    class Products {
      public:
        Products(device::Context& context, VulkanSummary& work, SlabBuffers& slab);

      private:
        friend class VulkanSummary;
        double units_ = 0;      // of work that was recorded
        device::Buffer parts_;  // uvec4 [block][window]
        device::Buffer sums_;   // WindowSum [block][material][window]
        device::BoundKernel window_, window_parts_, window_sums_;
    };

    /// Records everything for a slab of `voxels` voxels, filled up to `blocks` blocks. Marks twice,
    /// as VulkanMetric does.
    void record(device::PacedWork& work, Products& products, std::uint32_t voxels,
                std::uint32_t blocks) const;

    /// The seconds of a slab that is finished: what comes next is cut by them.
    void measured(const Products& products, double seconds);

    /// A weight that is negative, NaN or infinite.
    struct BadWeight {
        std::size_t window;
        std::uint32_t voxel;  // of the slab
        float weight;
    };

    /// Adds the sums of a slab to the totals, unless a weight is bad.
    std::optional<BadWeight> add(const Products& products, std::uint32_t blocks);

    /// The distances, after the last slab. Throws InputError for an empty window and what
    /// summary_distances() throws, unless this is a trial of a user's metric.
    MetricDistances distances(const WorkSite& site, bool is_trial);

  private:
    VulkanSummary(device::Context& context, const DeviceExtent& extent, const Metric& metric,
                  const MetricKernels& spirv);

    device::Context* context_;
    const Metric* metric_;
    DeviceExtent extent_;
    WindowTotals totals_;
    std::vector<bool> has_voxel_;  // [window]
    device::WorkBudget budget_;    // in blocks of a window of a material
    device::Buffer weights_;       // float64 [block][window][voxel]
    device::Kernel window_, window_parts_, window_sums_;
    std::optional<device::Kernel> feature_;  // of a metric without a twin
};

}  // namespace merl::engine
