#include "engine/distance/distances.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <numeric>
#include <optional>
#include <set>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/device/submission.h"
#include "engine/distance/host/host_work.h"
#include "engine/distance/vulkan/device_work.h"
#include "engine/metric/check/finding.h"

namespace merl::engine {
namespace {

/// A slab in flight: its buffers, and the commands that work on them.
struct Slot {
    Slot(device::Context& context, std::size_t device_metrics)
        : submission(context, static_cast<std::uint32_t>(1 + 2 * device_metrics)) {}

    std::optional<SlabBuffers> buffers;          // where a metric has no twin
    std::vector<DeviceWork::Products> products;  // per metric of the device
    device::Submission submission;
    std::uint32_t blocks = 0;  // of the slab that was submitted; 0 when there is none
    std::uint64_t first = 0;   // position of its first voxel
};

/// The whole computation: two slabs in flight on the device, and every metric's work on them.
class Computation {
  public:
    /// Called with what a slab shows of a metric, and the position of its first voxel.
    using Look = std::function<void(const Metric&, const Finding&, std::uint64_t first)>;

    Computation(device::Context& context, const SlabPlan& plan,
                std::span<const Metric* const> metrics, std::uint64_t grid_voxels, Look look)
        : plan_(plan), scratch_(context, plan, metrics), look_(std::move(look)) {
        std::vector<std::optional<DeviceWork>> works(metrics.size());
        tbb::parallel_for(std::size_t{0}, metrics.size(), [&](std::size_t m) {
            if (!plan.on_host(*metrics[m])) {
                works[m].emplace(context, plan, *metrics[m], grid_voxels);
            }
        });
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            is_on_host_.push_back(!works[m]);
            if (works[m]) {
                works_.push_back(std::move(*works[m]));
            } else {
                host_works_.emplace_back(plan, *metrics[m], grid_voxels);
            }
        }
        for (int i = 0; i < 2; ++i) {
            Slot& slot = slots_.emplace_back(context, works_.size());
            if (scratch_.grid) {
                slot.buffers.emplace(context, plan);
            }
            for (const auto& work : works_) {
                slot.products.emplace_back(context, work, slot.buffers ? &*slot.buffers : nullptr,
                                           scratch_);
            }
        }
    }

    /// The slot that is free next, once its slab is finished and added up.
    Slot& next_slot(DistanceSeconds& seconds) {
        std::swap(slots_[0], slots_[1]);
        finish(slots_[0], seconds);
        return slots_[0];
    }

    /// Reads a slab into the buffers of `slot`.
    void fill(Slot& slot, const Slab& slab, SlabReader& reader) {
        for (auto& work : host_works_) {
            work.weigh(slab);
        }
        for (std::size_t m = 0; m < works_.size(); ++m) {
            works_[m].weigh(slot.products[m], slab);
        }
        if (slot.buffers) {
            std::ranges::copy(std::as_bytes(std::span(slab.geometry)),
                              slot.buffers->geometry.host().begin());
        }
        reader.read(slab, [&](std::size_t material, std::span<const BlockSamples> blocks) {
            if (slot.buffers) {
                const std::size_t first = material * plan_.slab_blocks;
                std::ranges::copy(blocks, slot.buffers->samples.host_as<BlockSamples>().begin() +
                                              static_cast<std::ptrdiff_t>(first));
            }
            for (auto& work : host_works_) {
                work.make_grid(slab, material, blocks);
            }
            for (std::size_t m = 0; m < works_.size(); ++m) {
                works_[m].make_grid(slot.products[m], slab, material, blocks);
            }
        });
    }

    /// What the host computes itself of a slab that is read.
    void compute(const Slab& slab, DistanceSeconds& seconds) {
        for (auto& work : host_works_) {
            Stopwatch summing;
            work.sum(slab);
            seconds.difference += summing.lap();
            Stopwatch adding;
            work.add(slab);
            seconds.adding += adding.lap();
        }
    }

    /// Bytes held for that.
    std::uint64_t host_bytes() const {
        return std::accumulate(
            host_works_.begin(), host_works_.end(), std::uint64_t{0},
            [](std::uint64_t sum, const HostWork& work) { return sum + work.bytes(); });
    }

    void submit(Slot& slot, const Slab& slab) {
        if (works_.empty()) {
            return;
        }
        slot.first = slab.first;
        slot.blocks = static_cast<std::uint32_t>(slab.blocks());
        auto& s = slot.submission;
        s.begin();
        if (slot.buffers) {
            s.upload(slot.buffers->samples, slot.buffers->samples.bytes());
            s.upload(slot.buffers->geometry, slot.buffers->geometry.bytes());
        }
        s.mark();
        for (std::size_t m = 0; m < works_.size(); ++m) {
            works_[m].record(s, slot.products[m], static_cast<std::uint32_t>(slab.voxels),
                             slot.blocks);
        }
        s.submit();
    }

    /// Waits for the slab of `slot` and adds its partial sums to the totals.
    void finish(Slot& slot, DistanceSeconds& seconds) {
        if (slot.blocks == 0) {
            return;
        }
        Stopwatch waiting;
        slot.submission.wait();
        seconds.waiting += waiting.lap();
        const auto device = slot.submission.seconds();
        Stopwatch adding;
        for (std::size_t m = 0; m < works_.size(); ++m) {
            seconds.transform += device[2 * m];
            seconds.difference += device[2 * m + 1];
            if (const auto* finding = DeviceWork::finding(slot.products[m])) {
                look_(works_[m].metric(), *finding, slot.first);
            }
            works_[m].add(slot.products[m], slot.blocks);
        }
        slot.blocks = 0;
        seconds.adding += adding.lap();
    }

    /// After the last slab.
    std::vector<MetricDistances> distances(DistanceSeconds& seconds) {
        finish(slots_[1], seconds);  // the older one first: totals are added in voxel order
        finish(slots_[0], seconds);
        std::vector<MetricDistances> result;
        auto on_device = works_.begin();
        auto on_host = host_works_.begin();
        for (const bool is_on_host : is_on_host_) {
            result.push_back(is_on_host ? (on_host++)->distances() : (on_device++)->distances());
        }
        return result;
    }

  private:
    SlabPlan plan_;
    ScratchBuffers scratch_;
    Look look_;
    std::vector<bool> is_on_host_;  // of every metric
    std::vector<DeviceWork> works_;
    std::vector<HostWork> host_works_;
    std::vector<Slot> slots_;
};

/// The most that the list of visited voxels takes while it grows: a run for each theta_h and
/// theta_d, which is nothing unless the grid is of another shape than any that was measured.
std::uint64_t list_bytes(const Grid& grid) {
    return 2 * sizeof(VoxelRun) * grid.theta_h * std::uint64_t{grid.theta_d};
}

}  // namespace

DistanceResult compute_distances(device::Context& context, const Database& database,
                                 std::span<const Metric* const> metrics,
                                 const DistanceOptions& options) {
    Stopwatch total;
    const auto plan = [&](std::uint64_t voxels) {
        return plan_slabs(context.limits(), options.memory_bytes, database.materials().size(),
                          voxels, metrics, options.shaders_only,
                          static_cast<std::uint64_t>(tbb::this_task_arena::max_concurrency()),
                          list_bytes(database.grid()));
    };
    plan(database.grid().voxels());  // throws before the list is made
    const Domain domain(database.grid());
    const VoxelList voxels(domain, options.voxels);
    DistanceResult result;
    result.voxels = voxels.size();
    result.plan = plan(voxels.size());
    auto& seconds = result.seconds;
    std::set<const Metric*> warned;  // of a difference from itself: once
    Stopwatch kernels;
    Computation computation(
        context, result.plan, metrics, database.grid().voxels(),
        [&](const Metric& metric, const Finding& finding, std::uint64_t first) {
            const auto file_index = [&](std::uint32_t voxel) {
                return voxels.runs(first + voxel, first + voxel + 1).front().file_index;
            };
            if (finding.kind != Finding::fine) {
                throw InputError(explain(finding, metric, database, file_index(finding.voxel)));
            }
            if (finding.same_voxel != Finding::kNone && warned.insert(&metric).second) {
                result.warnings.push_back(
                    warn_of_same(finding, metric, database, file_index(finding.same_voxel)));
            }
        });
    seconds.kernels = kernels.lap();
    result.host_bytes = computation.host_bytes();
    SlabReader reader(database, voxels);
    for (std::uint64_t i = 0; i < result.plan.slabs; ++i) {
        const std::uint64_t first = i * result.plan.slab_voxels();
        const std::uint64_t last = std::min(first + result.plan.slab_voxels(), voxels.size());
        Slot& slot = computation.next_slot(seconds);
        Stopwatch reading;
        const Slab slab(domain, voxels, first, last);
        computation.fill(slot, slab, reader);
        seconds.reading += reading.lap();
        computation.submit(slot, slab);
        computation.compute(slab, seconds);
        context.check_validation();
        if (options.progress) {
            options.progress(static_cast<double>(i + 1) / static_cast<double>(result.plan.slabs));
        }
    }
    result.distances = computation.distances(seconds);
    context.check_validation();
    result.counts = reader.counts();
    result.content_hash = reader.content_hash();
    result.material_hashes = reader.material_hashes();
    const auto of_materials = reader.warnings();
    result.warnings.insert(result.warnings.end(), of_materials.begin(), of_materials.end());
    seconds.total = total.lap();
    return result;
}

}  // namespace merl::engine
