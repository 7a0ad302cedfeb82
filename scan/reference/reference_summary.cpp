#include "scan/reference/reference_summary.h"

#include <algorithm>
#include <functional>
#include <numeric>

#include "scan/reference/reference_scan.h"

namespace merl::scan {
namespace {

/// Which approximations of an original, by place in Approximations::list, have no nearer one.
std::vector<std::size_t> best_of(const ReferenceDistances& distances, const OriginalRange& range,
                                 std::size_t metric) {
    const auto values = distances.values_of(range, metric);
    const double least = *std::ranges::min_element(values);
    std::vector<std::size_t> best;
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (values[i] == least) {
            best.push_back(range.begin + i);
        }
    }
    return best;
}

MetricFigures figures_of(const ReferenceDistances& distances, std::size_t metric,
                         std::uint64_t complete, std::size_t hardest) {
    const auto& list = distances.approximations.list;
    const auto ranks = ranks_of(distances, metric);
    MetricFigures figures;
    figures.labels.resize(distances.approximations.labels.size());
    std::vector<double> sums(figures.labels.size());
    for (const auto& range : distances.ranges) {
        if (!distances.is_complete(range)) {
            continue;
        }
        for (std::size_t i = range.begin; i < range.end; ++i) {
            sums[list[i].label] += ranks[i];  // halves: exact
        }
        const auto best = best_of(distances, range, metric);
        for (const auto i : best) {
            auto& of_label = figures.labels[list[i].label];
            ++of_label.best;
            of_label.tied_best += best.size() > 1 ? 1 : 0;
        }
        const auto& first = list[best.front()];
        figures.hardest.push_back(
            {first.original, first.label,
             distances.table.metrics[metric].values[distances.pairs[best.front()]]});
    }
    for (std::size_t label = 0; label < sums.size() && complete > 0; ++label) {
        figures.labels[label].mean_rank = sums[label] / static_cast<double>(complete);
    }
    std::ranges::stable_sort(figures.hardest, std::greater(), &Hardness::distance);
    figures.hardest.resize(std::min(figures.hardest.size(), hardest));
    return figures;
}

MetricPair compare(const ReferenceDistances& distances, std::size_t first, std::size_t second) {
    MetricPair result{first, second, count_configurations(distances, first, second)};
    for (const auto& range : distances.ranges) {
        const auto one = best_of(distances, range, first);
        const auto other = best_of(distances, range, second);
        std::vector<std::size_t> both;
        std::ranges::set_intersection(one, other, std::back_inserter(both));
        result.different += both.empty() ? 1 : 0;
        result.partly += !both.empty() && one != other ? 1 : 0;
    }
    return result;
}

}  // namespace

std::vector<double> ranks_of(const ReferenceDistances& distances, std::size_t metric) {
    std::vector<double> ranks(distances.pairs.size());
    for (const auto& range : distances.ranges) {
        const auto values = distances.values_of(range, metric);
        std::vector<std::size_t> order(values.size());
        std::iota(order.begin(), order.end(), std::size_t{0});
        std::ranges::sort(order, {}, [&](std::size_t i) { return values[i]; });
        for (std::size_t begin = 0; begin < order.size();) {
            std::size_t end = begin;
            while (end < order.size() && values[order[end]] == values[order[begin]]) {
                ++end;
            }
            for (std::size_t i = begin; i < end; ++i) {
                ranks[range.begin + order[i]] = static_cast<double>(begin + 1 + end) / 2;
            }
            begin = end;
        }
    }
    return ranks;
}

ReferenceSummary summarise(const ReferenceDistances& distances, std::size_t hardest) {
    ReferenceSummary summary;
    for (const auto& range : distances.ranges) {
        summary.complete += distances.is_complete(range) ? 1 : 0;
        summary.contested += range.size() > 1 ? 1 : 0;
    }
    const auto metrics = distances.table.metrics.size();
    for (std::size_t m = 0; m < metrics; ++m) {
        summary.metrics.push_back(figures_of(distances, m, summary.complete, hardest));
        for (std::size_t other = m + 1; other < metrics; ++other) {
            summary.pairs.push_back(compare(distances, m, other));
        }
    }
    return summary;
}

}  // namespace merl::scan
