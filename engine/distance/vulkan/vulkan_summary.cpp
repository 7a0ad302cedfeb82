#include "engine/distance/vulkan/vulkan_summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>

#include "engine/device/submission.h"
#include "engine/distance/parts/window_check.h"
#include "engine/metric/metric_kernels.h"

namespace merl::engine {
namespace {

using device::Binding;
using device::BoundKernel;
using device::Buffer;
using device::Context;
using device::Kernel;
using device::PacedWork;
using device::Texels;
using device::Traffic;

constexpr auto kTexels = Binding::texels;
constexpr auto kStorage = Binding::storage;

constexpr std::uint32_t kLanes = 64;  // of a workgroup where nothing depends on it

/// As shaders/framework/window_parts.comp writes it.
struct Part {
    std::uint32_t first, last;  // the voxels of the block that have a weight are among these
    std::uint32_t bad;          // the first voxel with a bad weight; kBlockVoxels without one
    float weight;               // of that
};

/// Push constants of the kernels.
struct WindowPush {
    std::uint32_t voxel_count;
};
struct PartsPush {
    std::uint32_t count;
};
struct SumsPush {
    std::uint32_t slab_blocks, materials;
};
struct FeaturePush {
    std::uint32_t rows, features;
};

template <typename T>
std::span<const std::byte> bytes_of(const T& push) {
    return std::as_bytes(std::span(&push, 1));
}

std::size_t windows_of(const Metric& metric) {
    return metric.header.windows.size();
}

/// What a window at a voxel, or a feature, takes in float32 operations, likewise guessed as in
/// vulkan_metric.cpp.
double operations(const Metric& metric) {
    return 1.0 * 64 * 32 * (metric.has_twin() ? 1 : 10);
}

Kernel make_kernel(Context& context, const Metric& metric, const char* stage,
                   std::span<const std::uint32_t> spirv, std::vector<Binding> bindings,
                   std::uint32_t push_bytes, std::uint32_t lanes = kLanes) {
    return {context, fmt::format("{} {}", metric.name, stage), spirv,
            Kernel::Options{.bindings = std::move(bindings),
                            .constants = {lanes},
                            .push_bytes = push_bytes,
                            .one_subgroup = false}};
}

BoundKernel bind(Context& context, const Kernel& kernel, std::initializer_list<Buffer*> buffers) {
    return {context, kernel, std::span(buffers.begin(), buffers.size())};
}

std::uint32_t groups_of(std::size_t invocations) {
    return static_cast<std::uint32_t>((invocations + kLanes - 1) / kLanes);
}

Kernel feature_kernel(Context& context, const Metric& metric,
                      std::span<const std::uint32_t> spirv) {
    return make_kernel(context, metric, "feature", spirv, {kTexels, kStorage}, sizeof(FeaturePush));
}

/// Runs that kernel for some rows of means.
void evaluate(Context& context, const Metric& metric, const Kernel& feature,
              const std::function<void()>& meanwhile, std::span<const WindowMean> means,
              std::span<double> found) {
    const auto rows = static_cast<std::uint32_t>(means.size() / windows_of(metric));
    constexpr std::size_t kTexelBytes = 16;
    Buffer from(context, (means.size_bytes() + kTexelBytes - 1) / kTexelBytes * kTexelBytes,
                Traffic::upload, Texels::words);
    Buffer to(context, found.size_bytes(), Traffic::download);
    std::ranges::copy(std::as_bytes(means), from.host().begin());
    const auto kernel = bind(context, feature, {&from, &to});
    device::Submission submission(context);
    submission.begin();
    submission.upload(from, from.bytes());
    const device::WorkBudget budget(context.info(), kLanes * operations(metric));
    double units = 0;
    PacedWork(submission)
        .dispatch(kernel, bytes_of(FeaturePush{rows, metric.header.features}), groups_of(rows),
                  metric.header.features, {1, budget, units});
    submission.download(to, to.bytes());
    submission.submit();
    submission.wait(meanwhile);
    std::ranges::copy(to.host_as<const double>().first(found.size()), found.begin());
}

}  // namespace

Features device_features(Context& context, const Metric& metric,
                         const std::function<void()>& meanwhile) {
    const auto kernel = std::make_shared<const Kernel>(
        feature_kernel(context, metric, compile_feature(metric, context.limits().floats)));
    return [&context, &metric, &meanwhile, kernel](std::span<const WindowMean> means,
                                                   std::span<double> found) {
        evaluate(context, metric, *kernel, meanwhile, means, found);
        context.check_validation();
    };
}

std::uint64_t VulkanSummary::weights_bytes(const DeviceExtent& extent, const Metric& metric) {
    return extent.slab_voxels() * windows_of(metric) * sizeof(double);
}

std::uint64_t VulkanSummary::parts_bytes(const DeviceExtent& extent, const Metric& metric) {
    return extent.slab_blocks * windows_of(metric) * sizeof(Part);
}

std::uint64_t VulkanSummary::sums_bytes(const DeviceExtent& extent, const Metric& metric) {
    return std::uint64_t{extent.slab_blocks} * extent.materials() * windows_of(metric) *
           sizeof(WindowSum);
}

std::uint64_t VulkanSummary::fixed_bytes(const Metric& metric, std::uint32_t materials) {
    const std::uint64_t row =
        windows_of(metric) * sizeof(WindowMean) + metric.header.features * sizeof(double);
    return WindowTotals::bytes(metric, materials) +
           (metric.has_twin() ? 0 : 2 * most_rows(metric) * row);
}

VulkanSummary::VulkanSummary(Context& context, const DeviceExtent& extent, const Metric& metric)
    : VulkanSummary(context, extent, metric, compile_kernels(metric, context.limits().floats)) {}

VulkanSummary::VulkanSummary(Context& context, const DeviceExtent& extent, const Metric& metric,
                             const MetricKernels& spirv)
    : context_(&context),
      metric_(&metric),
      extent_(extent),
      totals_(metric, extent.materials()),
      has_voxel_(windows_of(metric)),
      budget_(context.info(), kBlockVoxels * operations(metric)),
      weights_(context, weights_bytes(extent, metric), Traffic::none, Texels::words),
      window_(make_kernel(context, metric, "window", spirv.window, {kTexels, kStorage},
                          sizeof(WindowPush))),
      window_parts_(make_kernel(context, metric, "parts of windows", spirv.window_parts,
                                {kTexels, kStorage}, sizeof(PartsPush))),
      window_sums_(make_kernel(context, metric, "sums of windows", spirv.window_sums,
                               {kTexels, kTexels, kTexels, kStorage}, sizeof(SumsPush),
                               kWindowLanes)) {
    if (!metric.has_twin()) {
        feature_.emplace(feature_kernel(context, metric, spirv.feature));
    }
}

VulkanSummary::Products::Products(Context& context, VulkanSummary& work, SlabBuffers& slab)
    : parts_(context, parts_bytes(work.extent_, *work.metric_), Traffic::download, Texels::words),
      sums_(context, sums_bytes(work.extent_, *work.metric_), Traffic::download),
      window_(bind(context, work.window_, {&slab.geometry, &work.weights_})),
      window_parts_(bind(context, work.window_parts_, {&work.weights_, &parts_})),
      window_sums_(
          bind(context, work.window_sums_, {&slab.samples, &work.weights_, &parts_, &sums_})) {}

void VulkanSummary::record(PacedWork& work, Products& products, std::uint32_t voxels,
                           std::uint32_t blocks) const {
    const auto windows = static_cast<std::uint32_t>(windows_of(*metric_));
    products.units_ = 0;
    const auto share = [&](double units_of_group) -> PacedWork::Share {
        return {units_of_group, budget_, products.units_};
    };
    work.dispatch(products.window_, bytes_of(WindowPush{voxels}), blocks * kBlockVoxels / kLanes,
                  windows, share(1.0 * kLanes / kBlockVoxels));
    // The weights are read once, by as many invocations as there are windows in blocks.
    work.dispatch(products.window_parts_, bytes_of(PartsPush{blocks * windows}),
                  groups_of(std::size_t{blocks} * windows), 1, share(kLanes / 16.0));
    work.submission.download(products.parts_, products.parts_.bytes());
    work.submission.mark();
    work.dispatch(products.window_sums_,
                  bytes_of(SumsPush{extent_.slab_blocks, extent_.materials()}), extent_.materials(),
                  blocks, share(windows / 16.0));
    work.submission.download(products.sums_, products.sums_.bytes());
    work.submission.mark();
}

void VulkanSummary::measured(const Products& products, double seconds) {
    budget_.measured(products.units_, seconds);
}

std::optional<VulkanSummary::BadWeight> VulkanSummary::add(const Products& products,
                                                           std::uint32_t blocks) {
    const std::size_t windows = windows_of(*metric_);
    const auto parts = products.parts_.host_as<const Part>();
    const auto sums = products.sums_.host_as<const WindowSum>();
    for (std::size_t at = 0; at < blocks * windows; ++at) {
        if (parts[at].bad < kBlockVoxels) {
            const auto block = static_cast<std::uint32_t>(at / windows);
            return BadWeight{at % windows, block * kBlockVoxels + parts[at].bad, parts[at].weight};
        }
    }
    for (std::size_t at = 0; at < blocks * windows; ++at) {
        if (parts[at].first == parts[at].last) {
            continue;
        }
        const std::size_t block = at / windows;
        const std::size_t window = at % windows;
        has_voxel_[window] = true;
        for (std::size_t m = 0; m < extent_.materials(); ++m) {
            totals_.add(m, window, sums[(block * extent_.materials() + m) * windows + window]);
        }
    }
    return std::nullopt;
}

MetricDistances VulkanSummary::distances(const WorkSite& site, bool is_trial) {
    const Features on_device = [&](std::span<const WindowMean> rows, std::span<double> found) {
        evaluate(*context_, *metric_, feature_.value(), site.meanwhile, rows, found);
    };
    if (is_trial && !metric_->has_twin()) {
        // Made-up materials, on a grid where a window may be empty: nobody asks for numbers. But
        // features have to end.
        auto means = totals_.means();
        std::vector<double> found(std::size_t{extent_.materials()} * metric_->header.features);
        on_device(means, found);
        return {.values = std::vector<double>(extent_.pairs->size()),
                .bounds = std::vector<double>(extent_.pairs->size()),
                .means = std::move(means)};
    }
    std::vector<std::string> empty;
    for (std::size_t w = 0; w < has_voxel_.size(); ++w) {
        if (!has_voxel_[w]) {
            empty.push_back(metric_->header.windows[w].name);
        }
    }
    refuse_empty_windows(*metric_, empty, site.database.grid());
    if (metric_->has_twin()) {
        return summary_distances(*metric_, totals_.means(), *extent_.pairs,
                                 site.database.materials());
    }
    return estimated_summary_distances(*metric_, totals_.means(), on_device, *extent_.pairs,
                                       site.database.materials());
}

}  // namespace merl::engine
