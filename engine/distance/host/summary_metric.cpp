#include "engine/distance/host/summary_metric.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>

#include "engine/base/widest_vectors.h"

namespace merl::engine {
namespace {

using Lanes = std::array<double, kWindowLanes>;

/// The sum of the lanes, in the order of shaders/framework/window_sums.comp.
double sum_of(Lanes& lanes) {
    for (std::size_t half = kWindowLanes / 2; half > 0; half /= 2) {
        for (std::size_t i = 0; i < half; ++i) {
            lanes[i] += lanes[i + half];
        }
    }
    return lanes[0];
}

MERL_SCAN_WIDEST_VECTORS double weighted_sum(const double* weights, const double* samples,
                                             std::size_t size) {
    Lanes lanes = {};
    for (std::size_t first = 0; first < size; first += kWindowLanes) {
        for (std::size_t i = 0; i < kWindowLanes; ++i) {
            lanes[i] += weights[first + i] * samples[first + i];
        }
    }
    return sum_of(lanes);
}

/// Without the voxels that are marked.
double sum_without(const double* weights, std::size_t size, const std::bitset<kBlockVoxels>& gaps,
                   std::size_t from) {
    Lanes lanes = {};
    for (std::size_t first = 0; first < size; first += kWindowLanes) {
        for (std::size_t i = 0; i < kWindowLanes; ++i) {
            lanes[i] += gaps[from + first + i] ? 0 : weights[first + i];
        }
    }
    return sum_of(lanes);
}

}  // namespace

SummaryMetric::SummaryMetric(const Metric& metric, const Extent& extent,
                             std::span<const std::string> materials)
    : metric_(&metric),
      pairs_(extent.pairs),
      materials_(materials),
      totals_(metric, extent.materials()),
      weights_(extent.slab_blocks * metric.header.windows.size()),
      parts_(weights_.size()) {}

std::uint64_t SummaryMetric::block_bytes(const Metric& metric) {
    return metric.header.windows.size() * (sizeof(BlockWeights) + sizeof(Part));
}

std::uint64_t SummaryMetric::fixed_bytes(const Metric& metric, std::uint32_t materials) {
    return WindowTotals::bytes(metric, materials);
}

void SummaryMetric::weigh(const Slab& slab) {
    const std::size_t windows = metric_->header.windows.size();
    tbb::parallel_for(std::size_t{0}, slab.blocks() * windows, [&](std::size_t at) {
        const std::size_t block = at / windows;
        auto& weights = weights_[at];
        metric_->twin.window(metric_->parameters, slab.voxels_of_block(block),
                             static_cast<std::uint32_t>(at % windows), weights);
        std::ranges::fill(std::span(weights).subspan(slab.filled(block)), 0.0);
        const auto is_inside = [](double weight) { return weight != 0; };
        const auto* const first = std::ranges::find_if(weights, is_inside);
        const auto* const last = std::find_if(weights.rbegin(), weights.rend(), is_inside).base();
        auto& part = parts_[at];
        part = {};
        if (first == weights.end()) {
            return;
        }
        constexpr auto kLanes = static_cast<std::ptrdiff_t>(kWindowLanes);
        part.first = static_cast<std::uint32_t>((first - weights.begin()) / kLanes * kLanes);
        part.last =
            static_cast<std::uint32_t>((last - weights.begin() + kLanes - 1) / kLanes * kLanes);
        part.weight = sum_without(&weights[part.first], part.last - part.first, {}, part.first);
    });
}

void SummaryMetric::add(std::size_t material, std::span<const BlockSamples> blocks,
                        std::span<const BlockGaps> gaps) {
    const std::size_t windows = metric_->header.windows.size();
    for (std::size_t block = 0; block < blocks.size(); ++block) {
        for (std::size_t w = 0; w < windows; ++w) {
            const auto& part = parts_[block * windows + w];
            const std::size_t size = part.last - part.first;
            if (size == 0) {
                continue;
            }
            const double* const weights = &weights_[block * windows + w][part.first];
            WindowSum sum;
            for (std::size_t c = 0; c < sum.samples.size(); ++c) {
                // What was not measured is 0 here, and adds nothing.
                sum.samples[c] = weighted_sum(weights, &blocks[block][c][part.first], size);
                sum.weights[c] = gaps.empty() || gaps[block][c].none()
                                     ? part.weight
                                     : sum_without(weights, size, gaps[block][c], part.first);
            }
            totals_.add(material, w, sum);
        }
    }
}

MetricDistances SummaryMetric::distances() const {
    return summary_distances(*metric_, totals_.means(), *pairs_, materials_);
}

}  // namespace merl::engine
