#include "engine/reflectance/distances.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <chrono>
#include <cmath>
#include <stdexcept>

#include "engine/device/submission.h"

namespace merl::reflectance {
namespace {

using device::Binding;
using device::BoundKernel;
using device::Buffer;
using device::Kernel;
using device::Submission;
using device::Traffic;

constexpr std::uint32_t kPrepareLanes = 64;

/// Push constants of shaders/framework/prepare.comp.
struct PreparePush {
    std::uint32_t stride, voxel_count, materials, padded_materials;
};

/// Push constants of shaders/framework/difference.comp.
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

/// The buffers of a slab in flight, and the commands that work on them.
struct Slot {
    Slot(device::Context& context, const SlabPlan& plan, std::size_t metric_count)
        : samples(context, plan.samples_bytes(), Traffic::upload),
          geometry(context, plan.voxels_bytes(), Traffic::upload),
          submission(context) {
        for (std::size_t i = 0; i < metric_count; ++i) {
            sums.emplace_back(context, plan.sums_bytes(), Traffic::download);
        }
    }

    Buffer samples;
    Buffer geometry;
    std::vector<Buffer> sums;  // per metric
    std::vector<BoundKernel> prepare;
    std::vector<BoundKernel> difference;
    Submission submission;
    std::uint32_t blocks = 0;  // of the slab that was submitted; 0 when there is none
};

/// The whole computation: kernels, buffers and totals.
class Computation {
  public:
    Computation(device::Context& context, const SlabPlan& plan,
                std::span<const Metric* const> metrics)
        : plan_(plan),
          metrics_(metrics),
          grid_(context, grid_bytes(plan, metrics), Traffic::none, true),
          totals_(metrics.size(), std::vector<double>(std::size_t{plan.tiles} * kTile * kTile)) {
        for (const auto* metric : metrics) {
            prepare_.emplace_back(
                context, fmt::format("{} prepare", metric->name), metric->prepare_spirv,
                Kernel::Options{.bindings = {Binding::storage, Binding::storage, Binding::storage},
                                .constants = {kPrepareLanes},
                                .push_bytes = sizeof(PreparePush)});
            difference_.emplace_back(
                context, fmt::format("{} difference", metric->name), metric->difference_spirv,
                Kernel::Options{.bindings = {Binding::texels, Binding::storage},
                                .constants = {context.limits().subgroup_size},
                                .push_bytes = sizeof(DifferencePush),
                                .one_subgroup = true});
        }
        for (int i = 0; i < 2; ++i) {
            Slot& slot = slots_.emplace_back(context, plan, metrics.size());
            for (std::size_t m = 0; m < metrics.size(); ++m) {
                Buffer* const samples[] = {&slot.samples, &slot.geometry, &grid_};
                Buffer* const grids[] = {&grid_, &slot.sums[m]};
                slot.prepare.emplace_back(context, prepare_[m], samples);
                slot.difference.emplace_back(context, difference_[m], grids);
            }
        }
    }

    /// The slot that is free next, once its slab is finished and added up.
    Slot& next_slot(DistanceSeconds& seconds) {
        std::swap(slots_[0], slots_[1]);
        finish(slots_[0], seconds);
        return slots_[0];
    }

    void submit(Slot& slot, std::uint64_t voxels) {
        slot.blocks = static_cast<std::uint32_t>((voxels + kBlockVoxels - 1) / kBlockVoxels);
        auto& s = slot.submission;
        s.begin();
        s.upload(slot.samples, plan_.samples_bytes());
        s.upload(slot.geometry, plan_.voxels_bytes());
        s.mark();
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            const PreparePush prepare = {static_cast<std::uint32_t>(plan_.slab_voxels()),
                                         static_cast<std::uint32_t>(voxels), plan_.materials,
                                         plan_.padded_materials};
            const std::uint32_t cells = slot.blocks * kBlockVoxels / metrics_[m]->voxels_per_cell();
            s.dispatch(slot.prepare[m], bytes_of(prepare), cells / kPrepareLanes,
                       plan_.padded_materials);
            s.mark();
            s.dispatch(slot.difference[m], bytes_of(DifferencePush{plan_.tiles_across}),
                       plan_.tiles, slot.blocks);
            s.mark();
            s.download(slot.sums[m], plan_.sums_bytes());
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
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            seconds.transform += device[2 * m];
            seconds.difference += device[2 * m + 1];
            constexpr std::size_t kSums = std::size_t{kTile} * kTile;
            const auto sums = slot.sums[m].host_as<const float>();
            tbb::parallel_for(std::size_t{0}, std::size_t{plan_.tiles}, [&](std::size_t tile) {
                double* total = totals_[m].data() + tile * kSums;
                for (std::size_t block = 0; block < slot.blocks; ++block) {
                    const float* sum = sums.data() + (block * plan_.tiles + tile) * kSums;
                    for (std::size_t i = 0; i < kSums; ++i) {
                        total[i] += static_cast<double>(sum[i]);
                    }
                }
            });
        }
        slot.blocks = 0;
        seconds.adding += adding.seconds();
    }

    /// After the last slab: E for each metric and pair.
    std::vector<std::vector<double>> distances(DistanceSeconds& seconds,
                                               std::uint64_t grid_voxels) {
        finish(slots_[1], seconds);  // the older one first: totals are added in voxel order
        finish(slots_[0], seconds);
        std::vector<std::vector<double>> result(metrics_.size());
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            for (std::uint32_t i = 0; i < plan_.materials; ++i) {
                for (std::uint32_t j = i + 1; j < plan_.materials; ++j) {
                    const double total = totals_[m][total_index(i, j)];
                    if (!std::isfinite(total) || total < 0) {
                        throw std::logic_error(
                            fmt::format("metric {}: the sum of materials {} and {} is {}",
                                        metrics_[m]->name, i, j, total));
                    }
                    result[m].push_back(std::sqrt(total / static_cast<double>(grid_voxels)));
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

    /// Where difference.comp puts the sum of materials i < j.
    std::size_t total_index(std::uint32_t i, std::uint32_t j) const {
        const std::size_t row = i / kTile;
        const std::size_t tile = row * plan_.tiles_across - row * (row + 1) / 2 + j / kTile;
        return (tile * kTile + i % kTile) * kTile + j % kTile;
    }

    SlabPlan plan_;
    std::span<const Metric* const> metrics_;
    Buffer grid_;
    std::vector<Kernel> prepare_, difference_;
    std::vector<Slot> slots_;
    std::vector<std::vector<double>> totals_;  // [metric][tile][row][column]
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
    Computation computation(context, result.plan, metrics);
    seconds.kernels = kernels.seconds();
    SlabReader reader(database, domain, voxels);
    for (std::uint64_t slab = 0; slab < result.plan.slabs; ++slab) {
        const std::uint64_t first = slab * result.plan.slab_voxels();
        const std::uint64_t last = std::min(first + result.plan.slab_voxels(), voxels.size());
        Slot& slot = computation.next_slot(seconds);
        const Clock reading;
        reader.read(first, last, slot.samples.host_as<float>(), result.plan.slab_voxels(),
                    slot.geometry.host_as<float>());
        seconds.reading += reading.seconds();
        computation.submit(slot, last - first);
        context.check_validation();
        if (options.progress) {
            options.progress(static_cast<double>(slab + 1) /
                             static_cast<double>(result.plan.slabs));
        }
    }
    result.distances = computation.distances(seconds, database.grid().voxels());
    context.check_validation();
    result.counts = reader.counts();
    result.content_hash = reader.content_hash();
    seconds.total = total.seconds();
    return result;
}

}  // namespace merl::reflectance
