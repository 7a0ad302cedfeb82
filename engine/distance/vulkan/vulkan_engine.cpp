#include "engine/distance/vulkan/vulkan_engine.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/stopwatch.h"
#include "engine/device/submission.h"
#include "engine/distance/vulkan/vulkan_metric.h"
#include "engine/distance/vulkan/vulkan_summary.h"

namespace merl::engine {
namespace {

/// A slab in flight: its buffers, and the commands that work on them.
struct Slot {
    Slot(device::Context& context, const DeviceExtent& extent, std::span<VulkanMetric> metrics,
         std::span<VulkanSummary> summaries, ScratchBuffers& scratch)
        : submission(context,
                     static_cast<std::uint32_t>(1 + 2 * (metrics.size() + summaries.size()))) {
        if (context.limits().floats.float64) {
            buffers.emplace(context, extent);
        }
        for (auto& metric : metrics) {
            products.emplace_back(context, metric, buffers ? &*buffers : nullptr, scratch);
        }
        for (auto& summary : summaries) {
            summary_products.emplace_back(context, summary, *buffers);
        }
    }

    std::optional<SlabBuffers> buffers;            // where the device makes the grids
    std::vector<VulkanMetric::Products> products;  // per metric
    std::vector<VulkanSummary::Products> summary_products;
    device::Submission submission;
    std::uint32_t blocks = 0;  // of the slab that was submitted; 0 when there is none
    std::uint64_t first = 0;   // position of its first voxel
};

/// Two slabs in flight: while the device computes one, the host fills the other.
class VulkanWork final : public EngineWork {
  public:
    VulkanWork(device::Context& context, std::span<const Metric* const> metrics,
               const Extent& extent, const WorkSite& site)
        : context_(context),
          extent_{extent.pairs, extent.slab_blocks, context.limits().tiles},
          scratch_(context, extent_, metrics),
          site_(site),
          all_(metrics.begin(), metrics.end()),
          is_trial_(extent.is_trial) {
        Stopwatch watch;
        std::vector<std::optional<VulkanMetric>> compiled(metrics.size());
        std::vector<std::optional<VulkanSummary>> summaries(metrics.size());
        tbb::parallel_for(std::size_t{0}, metrics.size(), [&](std::size_t m) {
            if (metrics[m]->is_summary()) {
                summaries[m].emplace(context, extent_, *metrics[m]);
            } else {
                compiled[m].emplace(context, extent_, *metrics[m], extent.grid_voxels);
            }
        });
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            if (metrics[m]->is_summary()) {
                summaries_.push_back(std::move(*summaries[m]));
            } else {
                metrics_.push_back(std::move(*compiled[m]));
            }
        }
        for (auto& slot : slots_) {
            slot = std::make_unique<Slot>(context, extent_, metrics_, summaries_, scratch_);
        }
        site_.seconds.kernels += watch.lap();
    }

    void begin(const Slab& slab) override {
        std::swap(slots_[0], slots_[1]);
        finish(*slots_[0]);
        slab_ = &slab;
        if (const auto& buffers = slots_[0]->buffers) {
            std::ranges::copy(std::as_bytes(std::span(slab.geometry)),
                              buffers->geometry.host().begin());
            return;
        }
        for (auto& metric : metrics_) {
            metric.weigh(slab);
        }
    }

    void take(std::size_t material, std::span<const BlockSamples> blocks,
              std::span<const BlockGaps> gaps) override {
        const Slot& slot = *slots_[0];
        if (slot.buffers) {
            const auto to = slot.buffers->samples.host_as<BlockSamples>().subspan(
                material * extent_.slab_blocks, blocks.size());
            std::ranges::copy(blocks, to.begin());
            if (!summaries_.empty()) {
                mark(to, gaps);
            }
            return;
        }
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            metrics_[m].make_grid(slot.products[m], *slab_, material, blocks);
        }
    }

    void compute() override {
        Slot& slot = *slots_[0];
        slot.first = slab_->first;
        slot.blocks = static_cast<std::uint32_t>(slab_->blocks());
        auto& s = slot.submission;
        s.begin();
        if (slot.buffers) {
            s.upload(slot.buffers->samples, slot.buffers->samples.bytes());
            s.upload(slot.buffers->geometry, slot.buffers->geometry.bytes());
        }
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            metrics_[m].upload(s, slot.products[m]);
        }
        s.mark();
        device::PacedWork work(s);
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            metrics_[m].record(work, slot.products[m], static_cast<std::uint32_t>(slab_->voxels),
                               slot.blocks);
        }
        for (std::size_t m = 0; m < summaries_.size(); ++m) {
            summaries_[m].record(work, slot.summary_products[m],
                                 static_cast<std::uint32_t>(slab_->voxels), slot.blocks);
        }
        s.submit();
        context_.check_validation();
    }

    std::vector<MetricDistances> distances() override {
        finish(*slots_[1]);  // the older one first: totals are added in voxel order
        finish(*slots_[0]);
        context_.check_validation();
        std::vector<MetricDistances> result;
        auto metric = metrics_.begin();
        auto summary = summaries_.begin();
        for (const auto* one : all_) {
            result.push_back(one->is_summary() ? summary++->distances(site_, is_trial_)
                                               : metric++->distances());
        }
        context_.check_validation();
        return result;
    }

    std::uint64_t peak_bytes() const override {
        std::uint64_t on_host = 0;
        for (const auto& metric : metrics_) {
            on_host += metric.host_bytes();
        }
        return context_.peak_allocated_bytes() + on_host;
    }

  private:
    /// Gives zeros that stand for what was not measured a sign, which samples have not.
    static void mark(std::span<BlockSamples> blocks, std::span<const BlockGaps> gaps) {
        for (std::size_t block = 0; block < gaps.size(); ++block) {
            for (std::size_t c = 0; c < gaps[block].size(); ++c) {
                for (std::size_t k = 0; gaps[block][c].any() && k < kBlockVoxels; ++k) {
                    if (gaps[block][c][k]) {
                        blocks[block][c][k] = -0.0;
                    }
                }
            }
        }
    }

    /// Waits for the slab of a slot and adds its partial sums to the totals.
    void finish(Slot& slot) {
        if (slot.blocks == 0) {
            return;
        }
        Stopwatch watch;
        slot.submission.wait(site_.meanwhile);
        site_.seconds.waiting += watch.lap();
        const auto device = slot.submission.seconds();
        for (std::size_t m = 0; m < metrics_.size(); ++m) {
            site_.seconds.transform += device[2 * m];
            site_.seconds.difference += device[2 * m + 1];
            metrics_[m].measured(slot.products[m], device[2 * m], device[2 * m + 1]);
            if (const auto* finding = VulkanMetric::finding(slot.products[m])) {
                look_at(metrics_[m].metric(), *finding, slot.first);
            }
            metrics_[m].add(slot.products[m], slot.blocks);
        }
        for (std::size_t m = 0; m < summaries_.size(); ++m) {
            const double transform = device[2 * (metrics_.size() + m)];
            const double difference = device[2 * (metrics_.size() + m) + 1];
            site_.seconds.transform += transform;
            site_.seconds.difference += difference;
            auto& summary = summaries_[m];
            summary.measured(slot.summary_products[m], transform + difference);
            if (const auto bad = summary.add(slot.summary_products[m], slot.blocks)) {
                throw InputError(explain_window(summary.metric(), bad->window, bad->weight,
                                                site_.database,
                                                file_index(slot.first + bad->voxel)));
            }
        }
        slot.blocks = 0;
        site_.seconds.adding += watch.lap();
    }

    /// What kernels found in a slab whose first voxel has this position.
    void look_at(const Metric& metric, const Finding& finding, std::uint64_t first) {
        if (finding.kind != Finding::fine) {
            const bool has_voxel = finding.first_material != Finding::kNone;
            throw InputError(explain(finding, metric, site_.database,
                                     has_voxel ? file_index(first + finding.voxel) : 0));
        }
        if (finding.same_voxel != Finding::kNone && warned_.insert(&metric).second) {
            site_.warnings.push_back(warn_of_same(finding, metric, site_.database,
                                                  file_index(first + finding.same_voxel)));
        }
    }

    /// Of the voxel at a position in the list of visited ones.
    std::uint64_t file_index(std::uint64_t position) const {
        return site_.voxels.runs(position, position + 1).front().file_index;
    }

    device::Context& context_;
    DeviceExtent extent_;
    ScratchBuffers scratch_;
    WorkSite site_;
    std::vector<const Metric*> all_;  // those of the next two, in the order of the results
    std::vector<VulkanMetric> metrics_;
    std::vector<VulkanSummary> summaries_;
    bool is_trial_;
    std::array<std::unique_ptr<Slot>, 2> slots_;  // the first is being filled
    const Slab* slab_ = nullptr;
    std::set<const Metric*> warned_;  // of a difference from itself: once
};

class VulkanEngine final : public Engine {
  public:
    explicit VulkanEngine(device::Context& context) : context_(context) {}

    EngineDescription description() const override {
        const auto& info = context_.info();
        return {.engine = "vulkan",
                .grids = info.limits.floats.float64 ? "device" : "host",
                .name = info.name,
                .kind = info.kind,
                .driver = info.driver,
                .vulkan = info.vulkan};
    }

    EngineNeeds needs(std::span<const Metric* const> metrics,
                      const PairList& pairs) const override {
        return device_needs(context_.limits(), metrics, pairs);
    }

    Features features(const Metric& metric, const std::function<void()>& meanwhile) override {
        // The library's are the same bits on every device.
        return metric.has_twin() ? twin_features(metric)
                                 : device_features(context_, metric, meanwhile);
    }

    std::unique_ptr<EngineWork> start(std::span<const Metric* const> metrics, const Extent& extent,
                                      const WorkSite& site) override {
        return std::make_unique<VulkanWork>(context_, metrics, extent, site);
    }

  private:
    device::Context& context_;
};

}  // namespace

std::unique_ptr<Engine> make_vulkan_engine(device::Context& context) {
    return std::make_unique<VulkanEngine>(context);
}

}  // namespace merl::engine
