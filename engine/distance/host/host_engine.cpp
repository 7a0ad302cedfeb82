#include "engine/distance/host/host_engine.h"

#include <stdexcept>
#include <type_traits>
#include <variant>

#include "engine/base/stopwatch.h"
#include "engine/distance/host/host_metric.h"
#include "engine/distance/host/summary_metric.h"
#include "engine/distance/host/twin_metric.h"

namespace merl::engine {
namespace {

class HostWork final : public EngineWork {
  public:
    HostWork(std::span<const Metric* const> metrics, const Extent& extent, const WorkSite& site,
             std::uint64_t bytes)
        : seconds_(site.seconds), bytes_(bytes) {
        for (const auto* metric : metrics) {
            if (metric->is_summary()) {
                metrics_.emplace_back(std::in_place_type<SummaryMetric>, *metric, extent,
                                      site.database.materials());
            } else if (metric->has_degree()) {
                metrics_.emplace_back(std::in_place_type<HostMetric>, *metric, *extent.pairs,
                                      extent.slab_blocks, extent.grid_voxels);
            } else {
                metrics_.emplace_back(std::in_place_type<TwinMetric>, *metric, *extent.pairs,
                                      extent.slab_blocks, extent.grid_voxels);
            }
        }
    }

    void begin(const Slab& slab) override {
        slab_ = &slab;
        each([&](auto& metric) { metric.weigh(slab); });
    }

    void take(std::size_t material, std::span<const BlockSamples> blocks,
              std::span<const BlockGaps> gaps) override {
        each([&]<typename Kind>(Kind& metric) {
            if constexpr (std::is_same_v<Kind, SummaryMetric>) {
                metric.add(material, blocks, gaps);
            } else {
                metric.make_grid(*slab_, material, blocks);
            }
        });
    }

    void compute() override {
        each([&]<typename Kind>(Kind& metric) {
            if constexpr (!std::is_same_v<Kind, SummaryMetric>) {
                Stopwatch watch;
                metric.sum(*slab_);
                seconds_.difference += watch.lap();
                metric.add(*slab_);
                seconds_.adding += watch.lap();
            }
        });
    }

    std::vector<MetricDistances> distances() override {
        std::vector<MetricDistances> result;
        each([&](auto& metric) { result.push_back(metric.distances()); });
        return result;
    }

    std::uint64_t peak_bytes() const override { return bytes_; }

  private:
    void each(const auto& what) {
        for (auto& metric : metrics_) {
            std::visit(what, metric);
        }
    }

    std::vector<std::variant<HostMetric, TwinMetric, SummaryMetric>> metrics_;
    DistanceSeconds& seconds_;
    std::uint64_t bytes_;
    const Slab* slab_ = nullptr;
};

class HostEngine final : public Engine {
  public:
    EngineDescription description() const override {
        return {.engine = "host",
                .grids = "host",
                .name = "host",
                .kind = "CPU",
                .driver = {},
                .vulkan = {}};
    }

    EngineNeeds needs(std::span<const Metric* const> metrics,
                      const PairList& pairs) const override {
        EngineNeeds needs = {.cached = true};
        for (const auto* metric : metrics) {
            if (!host_can(*metric)) {
                throw std::logic_error(metric->name + " has no twin");
            }
            if (metric->is_summary()) {
                needs.fixed_bytes += SummaryMetric::fixed_bytes(*metric, pairs.materials());
                needs.block_bytes += SummaryMetric::block_bytes(*metric);
            } else if (metric->has_degree()) {
                needs.fixed_bytes += HostMetric::fixed_bytes(*metric, pairs);
                needs.block_bytes += HostMetric::block_bytes(*metric, pairs);
            } else {
                needs.fixed_bytes += TwinMetric::fixed_bytes(pairs);
                needs.block_bytes += TwinMetric::block_bytes(pairs);
            }
        }
        return needs;
    }

    Features features(const Metric& metric, const std::function<void()>& /*meanwhile*/) override {
        return twin_features(metric);
    }

    std::unique_ptr<EngineWork> start(std::span<const Metric* const> metrics, const Extent& extent,
                                      const WorkSite& site) override {
        const auto [fixed, block, most, cached] = needs(metrics, *extent.pairs);
        return std::make_unique<HostWork>(metrics, extent, site,
                                          fixed + extent.slab_blocks * block);
    }
};

}  // namespace

std::unique_ptr<Engine> make_host_engine() {
    return std::make_unique<HostEngine>();
}

}  // namespace merl::engine
