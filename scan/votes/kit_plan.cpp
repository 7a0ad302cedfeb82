#include "scan/votes/kit_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>
#include <stdexcept>
#include <utility>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/pairs/agreement.h"
#include "scan/votes/kit_lots.h"

namespace merl::scan {
namespace {

std::optional<std::uint32_t> pair_of(const std::string& one, const std::string& other,
                                     const Distances& distances) {
    const auto index = [&](const std::string& name) -> std::optional<std::uint32_t> {
        const auto found = std::ranges::lower_bound(distances.names, name);
        if (found == distances.names.end() || *found != name) {
            return std::nullopt;
        }
        return static_cast<std::uint32_t>(found - distances.names.begin());
    };
    const auto a = index(one);
    const auto b = index(other);
    if (!a || !b || *a == *b) {
        return std::nullopt;
    }
    return pair_index({std::min(*a, *b), std::max(*a, *b)}, distances.materials());
}

FourMaterials materials_of(std::uint32_t left, std::uint32_t right, const Distances& distances) {
    const Pair l = pair_at(left, distances.materials());
    const Pair r = pair_at(right, distances.materials());
    const auto& names = distances.names;
    return {names[l.first], names[l.second], names[r.first], names[r.second]};
}

void add_sentinels(std::vector<KitTrial>& trials, const Distances& distances, const KitPlan& plan) {
    const auto first = places_in_order(distances.first);
    const auto second = places_in_order(distances.second);
    std::vector<std::uint32_t> near(first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        near[i] = std::max(first[i], second[i]);
    }
    Lots lots(plan.seed, Purpose::sentinels);
    const std::size_t candidates = sentinel_pairs(first.size());
    auto closest = smallest(near, candidates);
    auto farthest = smallest(farness(first, second), candidates);
    lots.shuffle(closest);
    lots.shuffle(farthest);
    std::set<std::uint32_t> taken;
    std::uint32_t added = 0;
    for (const auto close : closest) {
        for (const auto distant : farthest) {
            if (added == plan.sentinels) {
                return;
            }
            const Pair c = pair_at(close, distances.materials());
            const Pair d = pair_at(distant, distances.materials());
            const std::set<std::uint32_t> four = {c.first, c.second, d.first, d.second};
            const bool agree = distances.first[close] < distances.first[distant] &&
                               distances.second[close] < distances.second[distant];
            if (four.size() < 4 || !agree ||
                std::ranges::any_of(four, [&](auto m) { return taken.contains(m); })) {
                continue;
            }
            taken.insert(four.begin(), four.end());
            const bool left = lots.draw(2) == 0;
            trials.push_back({.configuration = trials.size() + 1,
                              .kind = TrialKind::sentinel,
                              .materials = left ? materials_of(close, distant, distances)
                                                : materials_of(distant, close, distances),
                              .expected = static_cast<std::uint8_t>(left ? 1 : 3),
                              .agreement = std::nullopt});
            ++added;
            break;
        }
    }
}

void add_random(std::vector<KitTrial>& trials, const SelectionFile& selection, const Distances& d,
                const KitPlan& plan) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> taken;
    for (const auto& row : selection.configurations) {
        const auto& m = row.materials;
        taken.insert(std::minmax(*pair_of(m[0], m[1], d), *pair_of(m[2], m[3], d)));
    }
    Lots lots(plan.seed, Purpose::random);
    std::uint32_t added = 0;
    for (std::uint64_t draw = 0; draw < most_draws && added < plan.random && d.pairs() > 1;
         ++draw) {
        const auto a = static_cast<std::uint32_t>(lots.draw(d.pairs()));
        const auto b = static_cast<std::uint32_t>(lots.draw(d.pairs()));
        if (a == b || !disagree(d.first[a], d.first[b], d.second[a], d.second[b]) ||
            !taken.insert(std::minmax(a, b)).second) {
            continue;
        }
        const auto found = make_configuration(d, a, b);
        trials.push_back({.configuration = trials.size() + 1,
                          .kind = TrialKind::random,
                          .materials = materials_of(found.left, found.right, d),
                          .expected = 0,
                          .agreement = found.agreement});
        ++added;
    }
}

}  // namespace

void expect_same_scan(const SelectionFile& selection, const Distances& distances,
                      const std::string& file) {
    for (std::size_t i = 0; i < selection.configurations.size(); ++i) {
        const auto& row = selection.configurations[i];
        for (std::size_t side = 0; side < 2; ++side) {
            const auto& one = row.materials[2 * side];
            const auto& other = row.materials[2 * side + 1];
            const auto pair = pair_of(one, other, distances);
            if (!pair) {
                throw InputError(
                    fmt::format("{}: there is no pair \"{}\" and \"{}\", which is in "
                                "row {} of {}; expected the pairs of the same scan",
                                file, one, other, i + 1, selection.file));
            }
            if (distances.first[*pair] != row.first[side] ||
                distances.second[*pair] != row.second[side]) {
                throw InputError(fmt::format(
                    "{}: \"{}\" and \"{}\" are at {} and {}, in row {} of {} at {} and {}; "
                    "expected the pairs of the same scan",
                    file, one, other, distances.first[*pair], distances.second[*pair], i + 1,
                    selection.file, row.first[side], row.second[side]));
            }
        }
    }
}

std::size_t sentinel_pairs(std::size_t pairs) {
    constexpr std::size_t least = 20;
    constexpr std::size_t one_in = 50;
    return std::min(pairs, std::max(least, pairs / one_in));
}

std::vector<KitTrial> plan_kit(const SelectionFile& selection, const Distances* distances,
                               const KitPlan& plan) {
    if (distances == nullptr && (plan.sentinels > 0 || plan.random > 0)) {
        throw std::invalid_argument("sentinels and random disagreements need distances");
    }
    auto trials = selection_trials(selection);
    if (plan.sentinels > 0) {
        add_sentinels(trials, *distances, plan);
    }
    if (plan.random > 0) {
        add_random(trials, selection, *distances, plan);
    }
    add_repeats(trials, plan);
    return trials;
}

std::vector<KitTrial> selection_trials(const SelectionFile& selection) {
    std::vector<KitTrial> trials;
    for (const auto& row : selection.configurations) {
        trials.push_back({.configuration = trials.size() + 1,
                          .kind = TrialKind::selection,
                          .materials = row.materials,
                          .expected = 0,
                          .agreement = row.agreement});
    }
    return trials;
}

void add_repeats(std::vector<KitTrial>& trials, const KitPlan& plan) {
    const auto rows =
        static_cast<std::size_t>(std::ranges::count(trials, TrialKind::selection, &KitTrial::kind));
    std::vector<std::size_t> order(rows);
    std::iota(order.begin(), order.end(), std::size_t{0});
    Lots(plan.seed, Purpose::repeats).shuffle(order);
    const auto repeats =
        static_cast<std::size_t>(std::ceil(static_cast<double>(rows) * plan.repeats / 100));
    order.resize(std::min(rows, repeats));
    std::ranges::sort(order);
    for (const auto row : order) {
        KitTrial repeat = trials[row];
        repeat.kind = TrialKind::repeat;
        trials.push_back(repeat);
    }
}

FourMaterials practice_of(const SelectionFile& selection) {
    const auto& last = selection.configurations.back().materials;
    return {last[0], last[0], last[0], last[1]};
}

}  // namespace merl::scan
