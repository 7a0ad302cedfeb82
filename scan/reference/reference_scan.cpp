#include "scan/reference/reference_scan.h"

#include <algorithm>
#include <functional>
#include <span>
#include <stdexcept>
#include <utility>

#include "scan/select/agreement_doubts.h"
#include "scan/select/participation.h"

namespace merl::scan {
namespace {

/// So many configurations are compared with those that are taken; where that does not do, all
/// distances are wanted instead of finding out which.
constexpr std::uint64_t most_compared = 1U << 26U;

/// Calls `visit` with the two pairs of every configuration.
template <typename Visit>
void for_each_configuration(const ReferenceDistances& distances, const Visit& visit) {
    for (const auto& range : distances.ranges) {
        for (std::size_t i = range.begin; i < range.end; ++i) {
            for (std::size_t j = i + 1; j < range.end; ++j) {
                visit(distances.pairs[i], distances.pairs[j]);
            }
        }
    }
}

/// Of which of all disagreements, in order, the greedy selection consists. `taking` is called with
/// each place that is taken, before it closes any material.
void take_greedily(
    const ReferenceDistances& distances, const std::vector<Configuration>& disagreements,
    std::uint32_t select, std::uint32_t per_material,
    const std::function<void(std::size_t place, const Participation& before)>& taking) {
    Participation participation(distances.table.materials(), per_material);
    const auto& pairs = distances.table.pairs;
    std::uint32_t chosen = 0;
    for (std::size_t i = 0; i < disagreements.size() && chosen < select; ++i) {
        const auto left = pairs[disagreements[i].left];
        const auto right = pairs[disagreements[i].right];
        if (participation.open(left) && participation.open(right)) {
            taking(i, participation);
            participation.take(left, right);
            ++chosen;
        }
    }
}

/// The bounds of a metric as far as something more exact can replace its distances.
std::vector<double> refinable_bounds(const MetricColumn& column, bool can_be_refined) {
    if (column.bounds.size() != column.values.size()) {
        throw std::invalid_argument("refinement needs the bounds of all metrics");
    }
    return can_be_refined && !column.is_final ? column.bounds
                                              : std::vector<double>(column.values.size());
}

/// Marks what the ranks and the hardest originals under a metric rest on.
void want_for_ranks(const ReferenceDistances& distances, std::size_t metric,
                    std::span<const double> bounds, std::vector<bool>& wanted) {
    const auto& values = distances.table.metrics[metric].values;
    const auto want = [&](std::span<const std::uint32_t> pairs) {
        std::vector<double> of_pairs;
        std::vector<double> their_bounds;
        for (const auto pair : pairs) {
            of_pairs.push_back(values[pair]);
            their_bounds.push_back(bounds[pair]);
        }
        const auto meeting = find_meeting(of_pairs, their_bounds);
        for (std::size_t i = 0; i < pairs.size(); ++i) {
            wanted[pairs[i]] = wanted[pairs[i]] || meeting[i];
        }
    };
    std::vector<std::uint32_t> best;
    for (const auto& range : distances.ranges) {
        const std::span pairs(distances.pairs.data() + range.begin, range.size());
        want(pairs);
        if (distances.is_complete(range)) {
            best.push_back(*std::ranges::min_element(
                pairs, {}, [&](std::uint32_t pair) { return values[pair]; }));
        }
    }
    want(best);
}

/// The pairs that the selection and its order rest on.
std::vector<bool> wanted_for_selection(const ReferenceDistances& distances,
                                       std::span<const double> first_bounds,
                                       std::span<const double> second_bounds, std::uint32_t select,
                                       std::uint32_t per_material) {
    const auto& table = distances.table;
    const AgreementDoubts doubts(table.metrics[0].values, first_bounds, table.metrics[1].values,
                                 second_bounds);
    auto wanted = doubts.loose();
    if (doubts.none()) {
        return wanted;
    }
    const auto want = [&](const Configuration& c) { wanted[c.left] = wanted[c.right] = true; };
    const auto all = disagreements_of(distances);
    std::uint64_t compared = 0;
    take_greedily(distances, all, select, per_material, [&](std::size_t place, const auto& before) {
        const auto& taken = all[place];
        want(taken);
        for (auto i = place + 1; i < all.size() && !doubts.surely_after(all[i], taken); ++i) {
            if (++compared > most_compared) {
                wanted.assign(wanted.size(), true);
                return;
            }
            if (doubts.may_come_before(all[i], taken) && before.open(table.pairs[all[i].left]) &&
                before.open(table.pairs[all[i].right])) {
                want(all[i]);
            }
        }
    });
    return wanted;
}

}  // namespace

Counts count_configurations(const ReferenceDistances& distances, std::size_t first,
                            std::size_t second) {
    const auto& d1 = distances.table.metrics[first].values;
    const auto& d2 = distances.table.metrics[second].values;
    Counts counts;
    for_each_configuration(distances, [&](std::uint32_t a, std::uint32_t b) {
        const bool tied_first = d1[a] == d1[b];
        const bool tied_second = d2[a] == d2[b];
        ++counts.configurations;
        if (tied_first || tied_second) {
            counts.tied_both += tied_first && tied_second ? 1 : 0;
            counts.tied_first_only += tied_second ? 0 : 1;
            counts.tied_second_only += tied_first ? 0 : 1;
        } else {
            counts.discordant += (d1[a] < d1[b]) != (d2[a] < d2[b]) ? 1 : 0;
        }
    });
    return counts;
}

std::vector<Configuration> disagreements_of(const ReferenceDistances& distances) {
    const auto& d1 = distances.table.metrics[0].values;
    const auto& d2 = distances.table.metrics[1].values;
    std::vector<Configuration> list;
    for_each_configuration(distances, [&](std::uint32_t a, std::uint32_t b) {
        if (disagree(d1[a], d1[b], d2[a], d2[b])) {
            list.push_back(make_configuration(d1, d2, a, b));
        }
    });
    std::ranges::sort(list, StrongerFirst());
    return list;
}

std::vector<Configuration> select_of(const ReferenceDistances& distances,
                                     const std::vector<Configuration>& disagreements,
                                     std::uint32_t select, std::uint32_t per_material) {
    std::vector<Configuration> chosen;
    take_greedily(
        distances, disagreements, select, per_material,
        [&](std::size_t place, const Participation&) { chosen.push_back(disagreements[place]); });
    return chosen;
}

std::vector<std::vector<std::uint32_t>> to_refine(const ReferenceDistances& distances,
                                                  const std::vector<bool>& can_be_refined,
                                                  std::uint32_t select,
                                                  std::uint32_t per_material) {
    const auto& metrics = distances.table.metrics;
    std::vector<std::vector<double>> bounds;
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        bounds.push_back(refinable_bounds(metrics[m], can_be_refined[m]));
    }
    const auto selected =
        wanted_for_selection(distances, bounds[0], bounds[1], select, per_material);
    std::vector<std::vector<std::uint32_t>> result(metrics.size());
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        auto wanted = m < 2 ? selected : std::vector<bool>(selected.size());
        want_for_ranks(distances, m, bounds[m], wanted);
        for (std::uint32_t pair = 0; pair < wanted.size(); ++pair) {
            if (wanted[pair] && bounds[m][pair] > 0) {
                result[m].push_back(pair);
            }
        }
    }
    return result;
}

Undecided find_undecided(const ReferenceDistances& distances, std::size_t most) {
    Undecided result;
    const auto& metrics = distances.table.metrics;
    const auto is_open = [](const MetricColumn& column, std::uint32_t a, std::uint32_t b) {
        const auto& values = column.values;
        const auto& bounds = column.bounds;
        if (bounds.empty()) {
            return false;
        }
        const bool tie =
            values[a] == values[b] && (column.is_final || (bounds[a] == 0 && bounds[b] == 0));
        const auto [low, high] = values[a] < values[b] ? std::pair(a, b) : std::pair(b, a);
        return !tie && values[high] - bounds[high] <= values[low] + bounds[low];
    };
    for_each_configuration(distances, [&](std::uint32_t a, std::uint32_t b) {
        result.configurations +=
            std::ranges::any_of(metrics, [&](const auto& column) { return is_open(column, a, b); })
                ? 1
                : 0;
    });
    for (const auto& column : metrics) {
        if (column.is_final && result.configurations > 0) {
            for_each_configuration(distances, [&](std::uint32_t a, std::uint32_t b) {
                if (result.open.size() < most && is_open(column, a, b)) {
                    result.open.push_back({std::min(a, b), std::max(a, b), column.metric});
                }
            });
        }
    }
    return result;
}

}  // namespace merl::scan
