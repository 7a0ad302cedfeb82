#include "engine/distance/vulkan/vulkan_metric.h"

#include <fmt/format.h>
#include <tbb/parallel_invoke.h>

#include <algorithm>

#include "engine/base/error.h"
#include "engine/distance/parts/twin_grid.h"
#include "engine/distance/vulkan/vulkan_summary.h"

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

constexpr std::uint32_t kLanes =
    64;  // of a workgroup that is not one subgroup: on lavapipe 256 can be twice as slow

constexpr std::uint64_t kTexelBytes = 16;

/// Push constants of the kernels in shaders/framework/.
struct WeighPush {
    std::uint32_t voxel_count;
};
struct PreparePush {
    std::uint32_t blocks, materials, padded_materials, voxel_count;
};
struct CheckPush {
    std::uint32_t step, padded_materials, materials, tile_count, pairs;
};
struct DegreePush {
    std::uint32_t step, numbers;
};
struct TilesPush {
    std::uint32_t padded_materials, materials, tile_count, first_tile;
};

/// What degree.comp looks at: 2^14 numbers of each power of two from 2^-40 up to 2^40, so many an
/// invocation.
constexpr std::uint32_t kDegreeNumbers = 80U << 14U;
constexpr std::uint32_t kDegreeNumbersOfInvocation = 32;

/// What making the grid of a block of a material takes, in float32 operations: some 64 a sample in
/// float64, of which a card that is made for games does one in the time of 32. Nobody knows what a
/// user's metric does.
double grid_operations(const Metric& metric) {
    return 3.0 * kBlockVoxels * 64 * 32 * (metric.has_twin() ? 1 : 10);
}

/// What a block of a pair takes: 16 a scalar for a power, 400 a voxel for the longest difference of
/// the library.
double pair_operations(const Metric& metric) {
    return kBlockVoxels * (metric.has_degree() ? 3 * 16.0 : metric.has_twin() ? 400.0 : 4000.0);
}

/// What a block of a pair takes check.comp, in units of that.
double check_units(const Metric& metric) {
    return metric.has_degree() ? 100 : 2;
}

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

/// A kernel that gives a subgroup to each tile of pairs, or to a row of one, or to each material.
Kernel make_subgroup_kernel(Context& context, const Metric& metric, const char* stage,
                            std::span<const std::uint32_t> spirv, std::vector<Binding> bindings,
                            const PairTiles& tiles, std::uint32_t push_bytes,
                            bool diagonal = false) {
    return {context, fmt::format("{} {}", metric.name, stage), spirv,
            Kernel::Options{
                .bindings = std::move(bindings),
                .constants = {context.limits().subgroup_size, diagonal ? 1U : 0U, tiles.side},
                .push_bytes = push_bytes,
                .one_subgroup = true}};
}

BoundKernel bind(Context& context, const Kernel& kernel, std::initializer_list<Buffer*> buffers) {
    return {context, kernel, std::span(buffers.begin(), buffers.size())};
}

Buffer download(Context& context, std::uint64_t bytes) {
    return {context, bytes, Traffic::download};
}

[[noreturn]] void refuse_pairs(const device::Limits& limits, const PairList& pairs) {
    throw Error(Fault::device,
                fmt::format("{} pairs of {} materials are more than this device can compute: its "
                            "largest dispatch is {} x {} workgroups",
                            pairs.size(), pairs.materials(), limits.groups_x, limits.groups_y));
}

/// The most bytes of a buffer that any of the metrics needs.
std::uint64_t most_of(const DeviceExtent& extent, std::span<const Metric* const> metrics,
                      std::uint64_t (DeviceExtent::*bytes)(const Metric&) const) {
    std::uint64_t most = 0;
    for (const auto* metric : metrics) {
        most = metric->is_summary() ? most : std::max(most, (extent.*bytes)(*metric));
    }
    return most;
}

}  // namespace

Roundings shader_roundings(const device::FloatControls& floats) {
    // A number is added in its texel, in its run of kRunTexels, which begins with the carry, with
    // the run where the total is the smaller of the two, and in the block's sum.
    Roundings roundings = {.power = 4e-7, .additions = 2 + kRunTexels + 1 + 1};
    if (!floats.adds_float64) {
        roundings.additions += 0.25;  // add_lanes.glsl
    }
    if (!floats.to_nearest) {  // but to either neighbour
        roundings.power = 1.2e-6;
        roundings.unit = 0x1p-23;
        roundings.grid = floats.float64 ? 0x1p-23 : roundings.grid;
    }
    return roundings;
}

std::uint64_t DeviceExtent::grid_bytes(const Metric& metric) const {
    const auto rows = tiles_of(metric).padded_materials();
    return std::uint64_t{slab_blocks} * rows * metric.block_texels() * kTexelBytes;
}

std::uint64_t DeviceExtent::ranges_bytes(const Metric& metric) const {
    return metric.has_slopes() ? grid_bytes(metric) / kChunkTexels / 2 : 0;
}

std::uint64_t DeviceExtent::norms_bytes(const Metric& metric) const {
    const auto rows = tiles_of(metric).padded_materials();
    return metric.has_norms() ? std::uint64_t{slab_blocks} * rows * sizeof(float) : 0;
}

std::uint64_t DeviceExtent::sums_bytes(const Metric& metric) const {
    const auto cut = tiles_of(metric);
    return std::uint64_t{slab_blocks} * cut.count() * cut.pairs_of_tile() * sizeof(float);
}

std::uint64_t DeviceExtent::places_bytes(const Metric& metric) const {
    const std::uint64_t checked =
        metric.is_checked() ? std::min<std::uint64_t>(pairs->materials(), pairs->size()) : 0;
    return (tiles_of(metric).count() + checked) * sizeof(PairTiles::Place);
}

EngineNeeds device_needs(const device::Limits& limits, std::span<const Metric* const> metrics,
                         const PairList& pairs) {
    const std::uint32_t materials = pairs.materials();
    const DeviceExtent block = {.pairs = &pairs, .slab_blocks = 1, .tiles = limits.tiles};
    EngineNeeds needs = {.cached = limits.is_host};
    const bool makes_grids = limits.floats.float64;
    std::uint64_t largest = 0;  // buffer
    std::uint64_t shared = 0;
    std::uint64_t ranges = 0;
    std::uint64_t places = 0;
    std::uint64_t own = 0;  // of a metric, for all slabs
    std::uint64_t up = 0;   // of a slab in flight
    std::uint64_t down = 0;
    if (makes_grids) {
        largest = std::max(block.samples_bytes(), block.geometry_bytes());
        up = block.samples_bytes() + block.geometry_bytes();
    }
    for (const auto* metric : metrics) {
        if (metric->is_summary()) {
            const auto weights = VulkanSummary::weights_bytes(block, *metric);
            const auto sums = VulkanSummary::sums_bytes(block, *metric);
            if (materials > limits.groups_x) {
                refuse_pairs(limits, pairs);
            }
            own += weights;
            down += VulkanSummary::parts_bytes(block, *metric) + sums;
            largest = std::max({largest, weights, sums});
            needs.fixed_bytes += VulkanSummary::fixed_bytes(*metric, materials);
            continue;
        }
        const auto tiles = block.tiles_of(*metric);
        const auto groups =
            std::max(tiles.count() * (metric->has_row_groups() ? tiles.side : std::uint64_t{1}),
                     std::uint64_t{metric->is_checked() ? materials : 0});
        if (groups > limits.groups_x || tiles.padded_materials() > limits.groups_y) {
            refuse_pairs(limits, pairs);
        }
        const auto sums = block.sums_bytes(*metric);
        const auto grid = block.grid_bytes(*metric);
        if (makes_grids) {
            shared = std::max(shared, block.weights_bytes() + grid);
        } else {
            up += grid;
            needs.block_bytes += sizeof(BlockWeights);
        }
        ranges = std::max(ranges, block.ranges_bytes(*metric));
        down += (metric->has_slopes() ? 2 : 1) * sums + block.norms_bytes(*metric);
        places += block.places_bytes(*metric);
        largest = std::max({largest, grid, sums, block.places_bytes(*metric)});
        needs.fixed_bytes += PairTotals::bytes(*metric, tiles);
    }
    const auto most_bytes = std::min({limits.storage_buffer_bytes, limits.allocation_bytes,
                                      limits.texel_buffer_texels * kTexelBytes});
    if (largest > most_bytes) {
        throw Error(Fault::device,
                    fmt::format("{} materials need a buffer of {} bytes, and this device allows {}",
                                materials, largest, most_bytes));
    }
    const std::uint64_t on_device = 2 * (up + down) + shared + ranges + own;
    needs.fixed_bytes += (limits.stages_uploads ? 2 : 1) * places;
    needs.block_bytes +=
        on_device + (limits.stages_uploads ? 2 * up : 0) + (limits.stages_downloads ? 2 * down : 0);
    if (places + on_device > limits.free_bytes) {
        throw Error(Fault::device,
                    fmt::format("{} materials need {:.1f} MiB of this device's memory, and {:.1f} "
                                "of its {:.1f} are free",
                                materials, static_cast<double>(places + on_device) / 1048576.0,
                                static_cast<double>(limits.free_bytes) / 1048576.0,
                                static_cast<double>(limits.heap_bytes) / 1048576.0));
    }
    // weigh.comp has the most groups along x, and the kernels of pairs a row of groups for a block.
    needs.most_blocks = std::min({most_bytes / largest, (limits.free_bytes - places) / on_device,
                                  std::uint64_t{limits.groups_y}});
    if (makes_grids) {
        needs.most_blocks =
            std::min(needs.most_blocks, std::uint64_t{limits.groups_x} / (kBlockVoxels / kLanes));
    }
    if (needs.most_blocks == 0) {
        throw Error(Fault::device,
                    fmt::format("this device allows {} workgroups, and one block needs {}",
                                limits.groups_x, kBlockVoxels / kLanes));
    }
    return needs;
}

SlabBuffers::SlabBuffers(Context& context, const DeviceExtent& extent)
    : samples(context, extent.samples_bytes(), Traffic::upload, Texels::words),
      geometry(context, extent.geometry_bytes(), Traffic::upload, Texels::words) {
    // Nothing on the device may meet a number that was never written.
    std::ranges::fill(samples.host(), std::byte{0});
    std::ranges::fill(geometry.host(), std::byte{0});
}

ScratchBuffers::ScratchBuffers(Context& context, const DeviceExtent& extent,
                               std::span<const Metric* const> metrics) {
    const bool has_grid = !std::ranges::all_of(metrics, &Metric::is_summary);
    if (context.limits().floats.float64 && has_grid) {
        weights.emplace(context, extent.weights_bytes(), Traffic::none, Texels::words);
        grid.emplace(context, most_of(extent, metrics, &DeviceExtent::grid_bytes), Traffic::none,
                     Texels::floats);
    }
    if (const auto bytes = most_of(extent, metrics, &DeviceExtent::ranges_bytes); bytes > 0) {
        ranges.emplace(context, bytes, Traffic::none, Texels::floats);
    }
}

VulkanMetric::VulkanMetric(Context& context, const DeviceExtent& extent, const Metric& metric,
                           std::uint64_t grid_voxels)
    : VulkanMetric(context, extent, metric, grid_voxels,
                   compile_kernels(metric, context.limits().floats)) {}

VulkanMetric::VulkanMetric(Context& context, const DeviceExtent& extent, const Metric& metric,
                           std::uint64_t grid_voxels, const MetricKernels& spirv)
    : metric_(&metric),
      extent_(extent),
      tiles_(extent.tiles_of(metric)),
      totals_(metric, tiles_, grid_voxels, shader_roundings(context.limits().floats)),
      checked_(metric.is_checked() ? extent.pairs->covering() : std::vector<MaterialPair>()),
      places_(context, extent.places_bytes(metric), Traffic::upload),
      grid_budget_(context.info(), grid_operations(metric)),
      pair_budget_(context.info(), pair_operations(metric)),
      weights_(context.limits().floats.float64 ? 0 : extent.slab_blocks),
      subgroup_size_(context.limits().subgroup_size) {
    const auto places = places_.host_as<PairTiles::Place>();
    for (std::size_t tile = 0; tile < tiles_.count(); ++tile) {
        places[tile] = tiles_.place_of(tile);
    }
    std::ranges::transform(checked_, places.begin() + static_cast<std::ptrdiff_t>(tiles_.count()),
                           [](const MaterialPair& pair) {
                               return PairTiles::Place{pair.first, pair.second};
                           });
    const bool looks_at_pairs = metric.is_checked() && !metric.has_degree();
    const auto of_tiles = [&](const char* stage, std::span<const std::uint32_t> code,
                              bool diagonal = false) {
        std::vector<Binding> bindings = {kTexels, kStorage, kStorage};
        if (code.data() == spirv.difference.data() && looks_at_pairs) {
            bindings.push_back(kStorage);
        }
        return make_subgroup_kernel(context, metric, stage, code, std::move(bindings), tiles_,
                                    sizeof(TilesPush), diagonal);
    };
    const auto of_materials = [&](const char* stage, std::span<const std::uint32_t> code) {
        return make_subgroup_kernel(context, metric, stage, code, {kTexels, kStorage}, tiles_, 0);
    };
    const bool has_diagonal = tiles_.on_diagonal() > 0;
    // Drivers take longer than anything else here, and use one thread for a kernel.
    tbb::parallel_invoke(
        [&] { difference_ = of_tiles("difference", spirv.difference); },
        [&] {
            if (metric.has_degree() && has_diagonal) {
                diagonal_difference_ = of_tiles("diagonal difference", spirv.difference, true);
            }
        },
        [&] {
            if (metric.has_slopes()) {
                range_ = of_materials("ranges", spirv.ranges);
                slope_ = of_tiles("slopes", spirv.slopes);
                if (has_diagonal) {
                    diagonal_slope_ = of_tiles("diagonal slopes", spirv.slopes, true);
                }
            }
        },
        [&] {
            if (metric.has_norms()) {
                norm_ = of_materials("norms", spirv.norms);
            }
        },
        [&] {
            if (!context.limits().floats.float64) {
                return;
            }
            weigh_ = make_kernel(context, metric, "weigh", spirv.weigh, {kTexels, kStorage},
                                 sizeof(WeighPush));
            prepare_ = make_kernel(context, metric, "prepare", spirv.prepare,
                                   {kTexels, kTexels, kTexels, kStorage}, sizeof(PreparePush));
        },
        [&] {
            if (metric.is_checked()) {
                check_ = make_subgroup_kernel(context, metric, "check", spirv.check,
                                              {kTexels, kTexels, kStorage, kStorage}, tiles_,
                                              sizeof(CheckPush));
            }
        },
        [&] {
            if (!spirv.degree.empty()) {
                degree_ = make_subgroup_kernel(context, metric, "degree", spirv.degree, {kStorage},
                                               tiles_, sizeof(DegreePush));
            }
        });
}

VulkanMetric::Products::Products(Context& context, VulkanMetric& work, SlabBuffers* slab,
                                 ScratchBuffers& scratch)
    : sums_(download(context, work.extent_.sums_bytes(*work.metric_))) {
    if (work.weigh_) {
        weigh_ = bind(context, *work.weigh_, {&slab->geometry, &*scratch.weights});
        prepare_ = bind(context, *work.prepare_,
                        {&slab->geometry, &slab->samples, &*scratch.weights, &*scratch.grid});
    } else {
        grid_.emplace(context, work.extent_.grid_bytes(*work.metric_), Traffic::upload,
                      Texels::floats);
        std::ranges::fill(grid_->host(), std::byte{0});  // materials that fill up the last tile
    }
    Buffer& grid = grid_ ? *grid_ : *scratch.grid;
    if (work.check_) {
        finding_ = download(context, sizeof(Finding));
        check_ = bind(context, *work.check_, {&grid, &*scratch.weights, &*finding_, &work.places_});
    }
    if (work.degree_) {
        degree_ = bind(context, *work.degree_, {&*finding_});
    }
    if (work.check_ && !work.degree_) {
        difference_ = bind(context, *work.difference_, {&grid, &sums_, &work.places_, &*finding_});
    } else {
        difference_ = bind(context, *work.difference_, {&grid, &sums_, &work.places_});
    }
    if (work.diagonal_difference_) {
        diagonal_difference_ =
            bind(context, *work.diagonal_difference_, {&grid, &sums_, &work.places_});
    }
    if (work.norm_) {
        norms_ = download(context, work.extent_.norms_bytes(*work.metric_));
        norm_ = bind(context, *work.norm_, {&grid, &*norms_});
    }
    if (work.slope_) {
        slopes_ = download(context, work.extent_.sums_bytes(*work.metric_));
        range_ = bind(context, *work.range_, {&grid, &*scratch.ranges});
        slope_ = bind(context, *work.slope_, {&*scratch.ranges, &*slopes_, &work.places_});
    }
    if (work.diagonal_slope_) {
        diagonal_slope_ =
            bind(context, *work.diagonal_slope_, {&*scratch.ranges, &*slopes_, &work.places_});
    }
}

void VulkanMetric::weigh(const Slab& slab) {
    fold_weights(*metric_, slab, weights_);
}

void VulkanMetric::make_grid(const Products& products, const Slab& slab, std::size_t material,
                             std::span<const BlockSamples> blocks) const {
    const std::size_t size = std::size_t{metric_->block_texels()} * 4;
    const auto grid = products.grid_->host_as<float>();
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        const auto part = grid.subspan((block * tiles_.padded_materials() + material) * size, size);
        if (metric_->has_degree()) {
            make_scalars(*metric_, slab, block, weights_[block], blocks[block],
                         part.first<kBlockScalars>());
        } else {
            make_weighted(*metric_, slab, block, weights_[block], blocks[block],
                          part.first<std::size_t{4} * kBlockVoxels>());
        }
    }
}

void VulkanMetric::upload(device::Submission& submission, const Products& products) {
    if (!has_places_) {  // for all slabs, which come after this one
        submission.upload(places_, places_.bytes());
        has_places_ = true;
    }
    if (products.grid_) {
        submission.upload(*products.grid_, products.grid_->bytes());
    }
}

void VulkanMetric::record(PacedWork& work, Products& products, std::uint32_t voxels,
                          std::uint32_t blocks) {
    auto& submission = work.submission;
    const std::uint32_t slab_voxels = blocks * kBlockVoxels;
    const std::uint32_t padded = tiles_.padded_materials();
    // As many as there are workgroups in a dispatch at most: device_needs().
    const auto above_diagonal = static_cast<std::uint32_t>(tiles_.above_diagonal());
    const auto on_diagonal = static_cast<std::uint32_t>(tiles_.on_diagonal());
    const std::uint32_t count = above_diagonal + on_diagonal;
    const TilesPush all = {padded, extent_.materials(), count, 0};
    const TilesPush from_diagonal = {padded, extent_.materials(), count, above_diagonal};
    products.grid_units_ = 0;
    products.pair_units_ = 0;
    const auto grid_work = [&](double units_of_group) -> PacedWork::Share {
        return {units_of_group, grid_budget_, products.grid_units_};
    };
    const auto pair_work = [&](double units_of_group) -> PacedWork::Share {
        return {units_of_group, pair_budget_, products.pair_units_};
    };
    const auto pairs = [&](std::optional<BoundKernel>& above, std::optional<BoundKernel>& diagonal,
                           double of_pair) {
        const auto of_tile = of_pair * static_cast<double>(tiles_.pairs_of_tile());
        if (above_diagonal > 0) {
            work.dispatch(*above, bytes_of(all), above_diagonal, blocks, pair_work(of_tile));
        }
        if (on_diagonal > 0) {
            work.dispatch(*diagonal, bytes_of(from_diagonal), on_diagonal, blocks,
                          pair_work(of_tile / 2));
        }
    };
    if (!products.grid_) {
        constexpr std::uint32_t kGroupsOfBlock = kBlockVoxels / kLanes;
        work.dispatch(*products.weigh_, bytes_of(WeighPush{voxels}), slab_voxels / kLanes, 1,
                      grid_work(1.0 / kGroupsOfBlock));
        work.dispatch(
            *products.prepare_,
            bytes_of(PreparePush{extent_.slab_blocks, extent_.materials(), padded, voxels}),
            slab_voxels / kCellVoxels / kLanes, padded,
            grid_work(1.0 * kCellVoxels / kGroupsOfBlock));
    }
    if (products.norm_) {  // as much as a pair, which is a small part of making the grid
        work.dispatch_whole(*products.norm_, {}, padded, blocks, grid_work(1.0 / 64));
        submission.download(*products.norms_, products.norms_->bytes());
    }
    submission.mark();
    if (products.slope_) {
        work.dispatch_whole(*products.range_, {}, padded, blocks, pair_work(1));
        pairs(products.slope_, products.diagonal_slope_, 1.0 / 16);
        submission.download(*products.slopes_, products.slopes_->bytes());
    }
    const auto checked = static_cast<std::uint32_t>(checked_.size());
    const auto check = [&](std::uint32_t step, std::uint32_t groups, std::uint32_t rows) {
        work.dispatch(*products.check_,
                      bytes_of(CheckPush{step, padded, extent_.materials(), count, checked}),
                      groups, rows, pair_work(check_units(*metric_)));
    };
    if (products.check_) {
        check(0, 1, 1);
        if (checked > 0) {
            check(1, checked, blocks);
        }
    }
    const bool asks_degree = products.degree_ && !std::exchange(knows_degree_, true);
    const auto degree = [&](std::uint32_t step, std::uint32_t groups) {
        // Nobody knows how long a user's difference is.
        work.dispatch(*products.degree_, bytes_of(DegreePush{step, kDegreeNumbers}), groups, 1,
                      pair_work(check_units(*metric_)));
    };
    if (asks_degree) {
        const std::uint32_t of_group = kDegreeNumbersOfInvocation * subgroup_size_;
        degree(0, kDegreeNumbers / of_group + 1);
    }
    const std::uint32_t rows = count * tiles_.side;  // of all tiles
    if (metric_->has_degree()) {
        pairs(products.difference_, products.diagonal_difference_, 1);
    } else {
        work.dispatch(*products.difference_, bytes_of(all), rows, blocks, pair_work(tiles_.side));
    }
    submission.download(products.sums_, products.sums_.bytes());
    if (products.check_) {
        check(2, 1, 1);
        if (asks_degree) {
            degree(1, 1);
        }
        submission.download(*products.finding_, sizeof(Finding));
    }
    submission.mark();
}

void VulkanMetric::measured(const Products& products, double grid_seconds, double pair_seconds) {
    grid_budget_.measured(products.grid_units_, grid_seconds);
    pair_budget_.measured(products.pair_units_, pair_seconds);
}

void VulkanMetric::add(const Products& products, std::uint32_t blocks) {
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

const Finding* VulkanMetric::finding(const Products& products) {
    return products.finding_ ? products.finding_->host_as<const Finding>().data() : nullptr;
}

}  // namespace merl::engine
