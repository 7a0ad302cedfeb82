#include "engine/distance/vulkan/device_work.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>

#include "engine/distance/host/host_grid.h"

namespace merl::engine {
namespace {

using device::Binding;
using device::BoundKernel;
using device::Buffer;
using device::Context;
using device::Kernel;
using device::Submission;
using device::Texels;
using device::Traffic;

constexpr auto kTexels = Binding::texels;
constexpr auto kStorage = Binding::storage;

constexpr std::uint32_t kLanes =
    64;  // of a workgroup that is not one subgroup: on lavapipe 256 can be twice as slow

/// Of difference.comp. The power: shaders/lib/numerics.glsl, tests/engine/device/device_test.cpp. A
/// number is added in its texel, in its run of eight texels, which begins with the carry, with the
/// run where the total is the smaller of the two, and in the block's sum.
constexpr Roundings kRoundings = {.power = 4e-7, .additions = 2 + 8 + 1 + 1};

/// Push constants of the kernels in shaders/framework/.
struct WeighPush {
    std::uint32_t voxel_count;
};
struct PreparePush {
    std::uint32_t blocks, materials, padded_materials, voxel_count;
};
struct CheckPush {
    std::uint32_t step, tiles_across, materials, groups;
};
struct TilesPush {
    std::uint32_t tiles_across, materials;
};

template <typename T>
std::span<const std::byte> bytes_of(const T& push) {
    return std::as_bytes(std::span(&push, 1));
}

Kernel make_kernel(Context& context, const Metric& metric, const char* stage,
                   std::span<const std::uint32_t> spirv, std::vector<Binding> bindings,
                   std::uint32_t push_bytes) {
    return {context, fmt::format("{} {}", metric.name, stage), spirv,
            Kernel::Options{.bindings = std::move(bindings),
                            .constants = {kLanes},
                            .push_bytes = push_bytes,
                            .one_subgroup = false}};
}

/// A kernel that gives a subgroup to each tile of pairs or to each material.
Kernel make_subgroup_kernel(Context& context, const Metric& metric, const char* stage,
                            std::span<const std::uint32_t> spirv, const PairTiles& tiles,
                            bool diagonal = false) {
    return {context, fmt::format("{} {}", metric.name, stage), spirv,
            Kernel::Options{
                .bindings = {kTexels, kStorage},
                .constants = {context.limits().subgroup_size, diagonal ? 1U : 0U, tiles.side},
                .push_bytes = sizeof(TilesPush),
                .one_subgroup = true}};
}

BoundKernel bind(Context& context, const Kernel& kernel, std::initializer_list<Buffer*> buffers) {
    return {context, kernel, std::span(buffers.begin(), buffers.size())};
}

Buffer download(Context& context, std::uint64_t bytes) {
    return {context, bytes, Traffic::download};
}

}  // namespace

SlabBuffers::SlabBuffers(Context& context, const SlabPlan& plan)
    : samples(context, plan.samples_bytes(), Traffic::upload, Texels::words),
      geometry(context, plan.geometry_bytes(), Traffic::upload, Texels::words) {
    // Nothing on the device may meet a number that was never written.
    std::ranges::fill(samples.host(), std::byte{0});
    std::ranges::fill(geometry.host(), std::byte{0});
}

ScratchBuffers::ScratchBuffers(Context& context, const SlabPlan& plan,
                               std::span<const Metric* const> metrics) {
    std::uint64_t grid_bytes = 0;
    std::uint64_t ranges_bytes = 0;
    for (const auto* metric : metrics) {
        if (plan.on_host(*metric)) {
            continue;
        }
        grid_bytes = std::max(grid_bytes, metric->has_twin() ? 0 : plan.grid_bytes(*metric));
        ranges_bytes = std::max(ranges_bytes, plan.ranges_bytes(*metric));
    }
    if (grid_bytes > 0) {
        weights.emplace(context, plan.weights_bytes(), Traffic::none, Texels::words);
        grid.emplace(context, grid_bytes, Traffic::none, Texels::floats);
    }
    if (ranges_bytes > 0) {
        ranges.emplace(context, ranges_bytes, Traffic::none, Texels::floats);
    }
}

DeviceWork::DeviceWork(Context& context, const SlabPlan& plan, const Metric& metric,
                       std::uint64_t grid_voxels)
    : DeviceWork(context, plan, metric, grid_voxels, compile_kernels(metric)) {}

DeviceWork::DeviceWork(Context& context, const SlabPlan& plan, const Metric& metric,
                       std::uint64_t grid_voxels, const MetricKernels& spirv)
    : metric_(&metric),
      plan_(plan),
      tiles_(plan.tiles(metric)),
      totals_(metric, plan.materials, tiles_, grid_voxels, kRoundings) {
    // Drivers take longer than anything else here, and use one thread for a kernel.
    tbb::parallel_invoke(
        [&] {
            difference_ =
                make_subgroup_kernel(context, metric, "difference", spirv.difference, tiles_);
        },
        [&] {
            if (metric.has_bound()) {
                diagonal_difference_ = make_subgroup_kernel(context, metric, "diagonal difference",
                                                            spirv.difference, tiles_, true);
            }
        },
        [&] {
            if (metric.has_slopes()) {
                range_ = make_subgroup_kernel(context, metric, "ranges", spirv.ranges, tiles_);
                slope_ = make_subgroup_kernel(context, metric, "slopes", spirv.slopes, tiles_);
                diagonal_slope_ = make_subgroup_kernel(context, metric, "diagonal slopes",
                                                       spirv.slopes, tiles_, true);
            }
        },
        [&] {
            if (metric.has_norms()) {
                norm_ = make_subgroup_kernel(context, metric, "norms", spirv.norms, tiles_);
            }
        },
        [&] {
            if (!metric.has_twin()) {
                weigh_ = make_kernel(context, metric, "weigh", spirv.weigh, {kTexels, kStorage},
                                     sizeof(WeighPush));
                prepare_ = make_kernel(context, metric, "prepare", spirv.prepare,
                                       {kTexels, kTexels, kTexels, kStorage}, sizeof(PreparePush));
            }
        },
        [&] {
            if (metric.is_checked()) {
                check_ = {
                    context, fmt::format("{} check", metric.name), spirv.check,
                    Kernel::Options{.bindings = {kTexels, kTexels, kStorage},
                                    .constants = {context.limits().subgroup_size, 0, tiles_.side},
                                    .push_bytes = sizeof(CheckPush),
                                    .one_subgroup = true}};
            }
        });
}

DeviceWork::Products::Products(Context& context, const DeviceWork& work, SlabBuffers* slab,
                               ScratchBuffers& scratch)
    : sums_(download(context, work.plan_.sums_bytes(*work.metric_))) {
    if (work.metric_->has_twin()) {
        grid_.emplace(context, work.plan_.grid_bytes(*work.metric_), Traffic::upload,
                      Texels::floats);
        // Materials that fill up the last tile are never written.
        std::ranges::fill(grid_->host(), std::byte{0});
        weights_.resize(work.plan_.slab_blocks);
    } else {
        weigh_ = bind(context, *work.weigh_, {&slab->geometry, &*scratch.weights});
        prepare_ = bind(context, *work.prepare_,
                        {&slab->geometry, &slab->samples, &*scratch.weights, &*scratch.grid});
    }
    Buffer& grid = grid_ ? *grid_ : *scratch.grid;
    difference_ = bind(context, *work.difference_, {&grid, &sums_});
    if (work.diagonal_difference_) {
        diagonal_difference_ = bind(context, *work.diagonal_difference_, {&grid, &sums_});
    }
    if (work.norm_) {
        norms_ = download(context, work.plan_.norms_bytes(*work.metric_));
        norm_ = bind(context, *work.norm_, {&grid, &*norms_});
    }
    if (work.slope_) {
        slopes_ = download(context, work.plan_.sums_bytes(*work.metric_));
        range_ = bind(context, *work.range_, {&grid, &*scratch.ranges});
        slope_ = bind(context, *work.slope_, {&*scratch.ranges, &*slopes_});
        diagonal_slope_ = bind(context, *work.diagonal_slope_, {&*scratch.ranges, &*slopes_});
    }
    if (work.check_) {
        finding_ = download(context, sizeof(Finding));
        check_ = bind(context, *work.check_, {&grid, &*scratch.weights, &*finding_});
    }
}

void DeviceWork::weigh(Products& products, const Slab& slab) const {
    if (metric_->has_twin()) {
        fold_weights(*metric_, slab, products.weights_);
    }
}

void DeviceWork::make_grid(Products& products, const Slab& slab, std::size_t material,
                           std::span<const BlockSamples> blocks) const {
    if (!metric_->has_twin()) {
        return;
    }
    const auto texels = products.grid_->host_as<float>();
    const std::size_t size = std::size_t{metric_->block_texels()} * 4;
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        engine::make_grid(
            *metric_, slab.voxels_of_block(block), slab.filled(block), products.weights_[block],
            blocks[block],
            texels.subspan((block * tiles_.padded_materials() + material) * size, size));
    }
}

void DeviceWork::record(Submission& submission, Products& products, std::uint32_t voxels,
                        std::uint32_t blocks) const {
    const std::uint32_t slab_voxels = blocks * kBlockVoxels;
    const std::uint32_t padded = tiles_.padded_materials();
    const TilesPush tiles = {tiles_.across, plan_.materials};
    const auto pairs = [&](BoundKernel& above_diagonal, BoundKernel& diagonal) {
        if (tiles_.above_diagonal() > 0) {
            submission.dispatch(above_diagonal, bytes_of(tiles), tiles_.above_diagonal(), blocks);
        }
        submission.dispatch(diagonal, bytes_of(tiles), tiles_.across, blocks);
    };
    if (products.grid_) {
        submission.upload(*products.grid_, products.grid_->bytes());
    } else {
        submission.dispatch(*products.weigh_, bytes_of(WeighPush{voxels}), slab_voxels / kLanes, 1);
        submission.dispatch(
            *products.prepare_,
            bytes_of(PreparePush{plan_.slab_blocks, plan_.materials, padded, voxels}),
            slab_voxels / kCellVoxels / kLanes, padded);
    }
    if (products.norm_) {
        submission.dispatch(*products.norm_, bytes_of(tiles), padded, blocks);
        submission.download(*products.norms_, products.norms_->bytes());
    }
    submission.mark();
    if (products.slope_) {
        submission.dispatch(*products.range_, bytes_of(tiles), padded, blocks);
        pairs(*products.slope_, *products.diagonal_slope_);
        submission.download(*products.slopes_, products.slopes_->bytes());
    }
    const std::uint32_t rows = tiles_.count() * tiles_.side;  // of all tiles
    if (products.diagonal_difference_) {
        pairs(*products.difference_, *products.diagonal_difference_);
    } else {
        submission.dispatch(*products.difference_, bytes_of(tiles), rows, blocks);
    }
    submission.download(products.sums_, products.sums_.bytes());
    if (products.check_) {
        for (std::uint32_t step = 0; step < 3; ++step) {
            submission.dispatch(*products.check_,
                                bytes_of(CheckPush{step, tiles_.across, plan_.materials, rows}),
                                step == 1 ? rows : 1, step == 1 ? blocks : 1);
        }
        submission.download(*products.finding_, sizeof(Finding));
    }
    submission.mark();
}

void DeviceWork::add(const Products& products, std::uint32_t blocks) {
    PartialSums sums;
    sums.differences = products.sums_.host_as<const float>();
    if (products.slopes_) {
        sums.slopes = products.slopes_->host_as<const float>();
    }
    if (products.norms_) {
        sums.norms = products.norms_->host_as<const float>();
    }
    totals_.add(sums, blocks);
}

const Finding* DeviceWork::finding(const Products& products) {
    return products.finding_ ? products.finding_->host_as<const Finding>().data() : nullptr;
}

}  // namespace merl::engine
