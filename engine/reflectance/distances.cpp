#include "engine/reflectance/distances.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "engine/device/submission.h"
#include "engine/error.h"
#include "engine/reflectance/error_bound.h"
#include "engine/reflectance/metric_check.h"
#include "engine/reflectance/metric_kernels.h"

namespace merl::reflectance {
namespace {

using device::Binding;
using device::BoundKernel;
using device::Buffer;
using device::Kernel;
using device::Submission;
using device::Texels;
using device::Traffic;

constexpr std::uint32_t kLanes = 256;  // of a workgroup that prepares
constexpr std::size_t kPairs = std::size_t{kTile} * kTile;

/// Push constants of the kernels in shaders/framework/.
struct WeighPush {
    std::uint32_t voxel_count;
};
struct PreparePush {
    std::uint32_t stride, materials, padded_materials, voxel_count;
};
struct CheckPush {
    std::uint32_t step, tiles_across, materials, groups;
};
struct DifferencePush {
    std::uint32_t tiles_across;
};

template <typename T>
std::span<const std::byte> bytes_of(const T& push) {
    return std::as_bytes(std::span(&push, 1));
}

class Clock {
  public:
    double seconds() const {
        return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
    }

  private:
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// What one metric makes of a slab in flight.
struct Products {
    Buffer sums;                   // [block][tile][row][column]
    std::optional<Buffer> errors;  // likewise, for a degree below one
    std::optional<Buffer> norms;   // [block][material], for a metric with a bound
    BoundKernel weigh, prepare, difference;
    std::optional<BoundKernel> norm;
    std::uint32_t groups_per_tile = 1;  // that compute differences
    std::optional<Buffer> finding;      // of a metric that is checked
    std::optional<BoundKernel> check;
};

/// The buffers of a slab in flight, and the commands that work on them.
struct Slot {
    Slot(device::Context& context, const SlabPlan& plan)
        : samples(context, plan.samples_bytes(), Traffic::upload, Texels::words),
          geometry(context, plan.geometry_bytes(), Traffic::upload, Texels::words),
          submission(context) {
        // Nothing on the device may meet a number that was never written.
        std::ranges::fill(samples.host(), std::byte{0});
        std::ranges::fill(geometry.host(), std::byte{0});
    }

    Buffer samples;
    Buffer geometry;
    std::vector<Products> products;  // per metric
    Submission submission;
    std::uint32_t blocks = 0;  // of the slab that was submitted; 0 when there is none
    std::uint64_t first = 0;   // position of its first voxel
};

/// One metric: its kernels, and its totals so far.
struct MetricWork {
    const Metric* metric;
    Kernel weigh, prepare, difference;
    std::optional<Kernel> norm;
    std::optional<Kernel> check;
    ErrorBound bound;
    std::vector<double> sums;    // [tile][row][column]
    std::vector<double> errors;  // likewise: the sum of what rounded samples can change
    std::vector<double> norms;   // [material]
};

Kernel make_kernel(device::Context& context, const Metric& metric, const char* stage,
                   std::span<const std::uint32_t> spirv, std::vector<Binding> bindings,
                   std::uint32_t push_bytes, bool one_subgroup) {
    return {context, fmt::format("{} {}", metric.name, stage), spirv,
            Kernel::Options{.bindings = std::move(bindings),
                            .constants = {one_subgroup ? context.limits().subgroup_size : kLanes},
                            .push_bytes = push_bytes,
                            .one_subgroup = one_subgroup}};
}

MetricWork make_work(device::Context& context, const SlabPlan& plan, const Metric& metric,
                     std::uint64_t grid_voxels) {
    constexpr auto kTexels = Binding::texels;
    constexpr auto kStorage = Binding::storage;
    const MetricKernels spirv = compile_kernels(metric);
    std::vector<Binding> difference = {kTexels, kStorage};
    if (metric.has_error_sums()) {
        difference.push_back(kStorage);
    }
    MetricWork work = {
        .metric = &metric,
        .weigh = make_kernel(context, metric, "weigh", spirv.weigh, {kTexels, kStorage},
                             sizeof(WeighPush), false),
        .prepare = make_kernel(context, metric, "prepare", spirv.prepare,
                               {kTexels, kTexels, kTexels, kStorage}, sizeof(PreparePush), false),
        .difference = make_kernel(context, metric, "difference", spirv.difference, difference,
                                  sizeof(DifferencePush), true),
        .norm = {},
        .check = {},
        .bound = {metric, grid_voxels},
        .sums = std::vector<double>(std::size_t{plan.tiles} * kPairs),
        .errors =
            std::vector<double>(metric.has_error_sums() ? std::size_t{plan.tiles} * kPairs : 0),
        .norms = std::vector<double>(plan.padded_materials)};
    if (!spirv.check.empty()) {
        work.check = make_kernel(context, metric, "check", spirv.check,
                                 {kTexels, kTexels, kStorage}, sizeof(CheckPush), true);
    }
    if (metric.has_bound()) {
        work.norm =
            make_kernel(context, metric, "norms", spirv.norms, {kTexels, kStorage}, 0, true);
    }
    return work;
}

/// Which tile of the triangle of pairs, and which of its pairs, difference.comp gives to i < j.
std::size_t sum_index(const SlabPlan& plan, std::uint32_t i, std::uint32_t j) {
    const std::size_t row = i / kTile;
    const std::size_t tile = row * plan.tiles_across - row * (row + 1) / 2 + j / kTile;
    return tile * kPairs + std::size_t{i % kTile} * kTile + j % kTile;
}

/// The whole computation: kernels, buffers and totals.
class Computation {
  public:
    /// Called with what is wrong with a metric, and the position of the voxel; throws.
    using Refuse = std::function<void(const Metric&, const Finding&, std::uint64_t position)>;

    Computation(device::Context& context, const SlabPlan& plan,
                std::span<const Metric* const> metrics, std::uint64_t grid_voxels, Refuse refuse)
        : plan_(plan),
          refuse_(std::move(refuse)),
          grid_voxels_(grid_voxels),
          weights_(context, plan.weights_bytes(), Traffic::none, Texels::words),
          grid_(context, grid_bytes(plan, metrics), Traffic::none, Texels::floats) {
        for (const auto* metric : metrics) {
            works_.push_back(make_work(context, plan, *metric, grid_voxels));
        }
        for (std::uint32_t row = 0; row < plan.tiles_across; ++row) {
            for (std::uint32_t column = row; column < plan.tiles_across; ++column) {
                tiles_.emplace_back(row, column);
            }
        }
        for (int i = 0; i < 2; ++i) {
            Slot& slot = slots_.emplace_back(context, plan);
            for (const auto& work : works_) {
                slot.products.push_back(make_products(context, slot, work));
            }
        }
    }

    /// The slot that is free next, once its slab is finished and added up.
    Slot& next_slot(DistanceSeconds& seconds) {
        std::swap(slots_[0], slots_[1]);
        finish(slots_[0], seconds);
        return slots_[0];
    }

    /// `first` is the slab's first position in the list of visited voxels.
    void submit(Slot& slot, std::uint64_t first, std::uint64_t voxels) {
        slot.first = first;
        slot.blocks = static_cast<std::uint32_t>((voxels + kBlockVoxels - 1) / kBlockVoxels);
        const std::uint32_t slab_voxels = slot.blocks * kBlockVoxels;
        auto& s = slot.submission;
        s.begin();
        s.upload(slot.samples, plan_.samples_bytes());
        s.upload(slot.geometry, plan_.geometry_bytes());
        s.mark();
        for (auto& p : slot.products) {
            s.dispatch(p.weigh, bytes_of(WeighPush{static_cast<std::uint32_t>(voxels)}),
                       slab_voxels / kLanes, 1);
            s.dispatch(p.prepare,
                       bytes_of(PreparePush{static_cast<std::uint32_t>(plan_.slab_voxels()),
                                            plan_.materials, plan_.padded_materials,
                                            static_cast<std::uint32_t>(voxels)}),
                       slab_voxels / kCellVoxels / kLanes, plan_.padded_materials);
            if (p.norm) {
                s.dispatch(*p.norm, {}, plan_.padded_materials, slot.blocks);
                s.download(*p.norms, plan_.norms_bytes());
            }
            s.mark();
            s.dispatch(p.difference, bytes_of(DifferencePush{plan_.tiles_across}),
                       plan_.tiles * p.groups_per_tile, slot.blocks);
            s.download(p.sums, plan_.sums_bytes());
            if (p.check) {
                const std::uint32_t groups = plan_.tiles * kTile;
                for (std::uint32_t step = 0; step < 3; ++step) {
                    s.dispatch(
                        *p.check,
                        bytes_of(CheckPush{step, plan_.tiles_across, plan_.materials, groups}),
                        step == 1 ? groups : 1, step == 1 ? slot.blocks : 1);
                }
                s.download(*p.finding, sizeof(Finding));
            }
            if (p.errors) {
                s.download(*p.errors, plan_.sums_bytes());
            }
            s.mark();
        }
        s.submit();
    }

    /// Waits for the slab of `slot` and adds its partial sums to the totals.
    void finish(Slot& slot, DistanceSeconds& seconds) {
        if (slot.blocks == 0) {
            return;
        }
        const Clock waiting;
        slot.submission.wait();
        seconds.waiting += waiting.seconds();
        const auto device = slot.submission.seconds();
        const Clock adding;
        for (std::size_t m = 0; m < works_.size(); ++m) {
            seconds.transform += device[2 * m];
            seconds.difference += device[2 * m + 1];
            if (slot.products[m].finding) {
                const auto& finding = slot.products[m].finding->host_as<const Finding>()[0];
                if (finding.kind != Finding::fine) {
                    refuse_(*works_[m].metric, finding, slot.first + finding.voxel);
                }
            }
            add(works_[m], slot.products[m], slot.blocks);
        }
        slot.blocks = 0;
        seconds.adding += adding.seconds();
    }

    /// After the last slab.
    std::vector<MetricDistances> distances(DistanceSeconds& seconds) {
        finish(slots_[1], seconds);  // the older one first: totals are added in voxel order
        finish(slots_[0], seconds);
        std::vector<MetricDistances> result;
        for (const auto& work : works_) {
            auto& d = result.emplace_back();
            for (std::uint32_t i = 0; i < plan_.materials; ++i) {
                for (std::uint32_t j = i + 1; j < plan_.materials; ++j) {
                    const std::size_t at = sum_index(plan_, i, j);
                    const double sum = work.sums[at];
                    if (!std::isfinite(sum) || sum < 0) {
                        throw std::logic_error(
                            fmt::format("metric {}: the sum of materials {} and {} is {}",
                                        work.metric->name, i, j, sum));
                    }
                    d.values.push_back(std::sqrt(sum / static_cast<double>(grid_voxels_)));
                    d.bounds.push_back(
                        work.bound.distance(sum, work.norms[i], work.norms[j],
                                            work.errors.empty() ? 0 : work.errors[at]));
                }
            }
        }
        return result;
    }

  private:
    static std::uint64_t grid_bytes(const SlabPlan& plan, std::span<const Metric* const> metrics) {
        std::uint64_t bytes = 0;
        for (const auto* metric : metrics) {
            bytes = std::max(bytes, plan.grid_bytes(metric->block_texels()));
        }
        return bytes;
    }

    Products make_products(device::Context& context, Slot& slot, const MetricWork& work) {
        Buffer sums(context, plan_.sums_bytes(), Traffic::download);
        std::optional<Buffer> errors;
        std::optional<Buffer> norms;
        std::optional<BoundKernel> norm;
        std::vector<Buffer*> difference = {&grid_, &sums};
        if (work.metric->has_error_sums()) {
            errors.emplace(context, plan_.sums_bytes(), Traffic::download);
            difference.push_back(&*errors);
        }
        if (work.norm) {
            norms.emplace(context, plan_.norms_bytes(), Traffic::download);
            Buffer* const buffers[] = {&grid_, &*norms};
            norm.emplace(context, *work.norm, buffers);
        }
        Buffer* const weigh[] = {&slot.geometry, &weights_};
        Buffer* const prepare[] = {&slot.geometry, &slot.samples, &weights_, &grid_};
        BoundKernel bound_difference(context, work.difference, difference);
        std::optional<Buffer> finding;
        std::optional<BoundKernel> check;
        if (work.check) {
            finding.emplace(context, sizeof(Finding), Traffic::download);
            Buffer* const buffers[] = {&grid_, &weights_, &*finding};
            check.emplace(context, *work.check, buffers);
        }
        return {.sums = std::move(sums),
                .errors = std::move(errors),
                .norms = std::move(norms),
                .weigh = {context, work.weigh, weigh},
                .prepare = {context, work.prepare, prepare},
                .difference = std::move(bound_difference),
                .norm = std::move(norm),
                .groups_per_tile = work.metric->groups_per_tile(),
                .finding = std::move(finding),
                .check = std::move(check)};
    }

    /// Adds the partial sums of a slab, each pair's in the order of the blocks.
    void add(MetricWork& work, const Products& p, std::uint32_t blocks) {
        const auto sums = p.sums.host_as<const float>();
        const auto errors = p.errors ? p.errors->host_as<const float>() : std::span<const float>();
        const auto norms = p.norms ? p.norms->host_as<const float>() : std::span<const float>();
        for (std::size_t i = 0;
             i < norms.size() && i < std::size_t{blocks} * plan_.padded_materials; ++i) {
            work.norms[i % plan_.padded_materials] += static_cast<double>(norms[i]);
        }
        tbb::parallel_for(std::size_t{0}, std::size_t{plan_.tiles}, [&](std::size_t tile) {
            const auto [row, column] = tiles_[tile];
            for (std::size_t block = 0; block < blocks; ++block) {
                const std::size_t from = (block * plan_.tiles + tile) * kPairs;
                const std::size_t to = tile * kPairs;
                for (std::size_t i = 0; i < kPairs; ++i) {
                    work.sums[to + i] += static_cast<double>(sums[from + i]);
                }
                if (errors.empty()) {
                    continue;
                }
                const auto* block_norms = norms.data() + block * plan_.padded_materials;
                const std::size_t first_row = std::size_t{row} * kTile;
                const std::size_t first_column = std::size_t{column} * kTile;
                for (std::size_t i = 0; i < kPairs; ++i) {
                    work.errors[to + i] += work.bound.block_error(
                        static_cast<double>(errors[from + i]),
                        static_cast<double>(block_norms[first_row + i / kTile]) +
                            static_cast<double>(block_norms[first_column + i % kTile]));
                }
            }
        });
    }

    SlabPlan plan_;
    Refuse refuse_;
    std::uint64_t grid_voxels_;
    Buffer weights_;
    Buffer grid_;
    std::vector<MetricWork> works_;
    std::vector<std::pair<std::uint32_t, std::uint32_t>> tiles_;  // row and column of each tile
    std::vector<Slot> slots_;
};

}  // namespace

DistanceResult compute_distances(device::Context& context, const Database& database,
                                 std::span<const Metric* const> metrics,
                                 const DistanceOptions& options) {
    const Clock total;
    const Domain domain(database.grid());
    const VoxelList voxels(domain, options.voxels);
    DistanceResult result;
    result.voxels = voxels.size();
    result.plan = plan_slabs(context.limits(), options.memory_bytes, database.materials().size(),
                             voxels.size(), metrics);
    auto& seconds = result.seconds;
    const Clock kernels;
    Computation computation(
        context, result.plan, metrics, database.grid().voxels(),
        [&](const Metric& metric, const Finding& finding, std::uint64_t position) {
            const auto run = voxels.runs(position, position + 1).front();
            throw Error(Fault::input, explain(finding, metric, database, run.file_index));
        });
    seconds.kernels = kernels.seconds();
    SlabReader reader(database, domain, voxels);
    for (std::uint64_t slab = 0; slab < result.plan.slabs; ++slab) {
        const std::uint64_t first = slab * result.plan.slab_voxels();
        const std::uint64_t last = std::min(first + result.plan.slab_voxels(), voxels.size());
        Slot& slot = computation.next_slot(seconds);
        const Clock reading;
        reader.read(first, last, slot.samples.host_as<double>(), result.plan.slab_voxels(),
                    slot.geometry.host_as<double>());
        seconds.reading += reading.seconds();
        computation.submit(slot, first, last - first);
        context.check_validation();
        if (options.progress) {
            options.progress(static_cast<double>(slab + 1) /
                             static_cast<double>(result.plan.slabs));
        }
    }
    result.distances = computation.distances(seconds);
    context.check_validation();
    result.counts = reader.counts();
    result.content_hash = reader.content_hash();
    seconds.total = total.seconds();
    return result;
}

}  // namespace merl::reflectance
