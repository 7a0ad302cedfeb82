#include "scan/votes/reference_kit_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <optional>
#include <set>
#include <span>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "scan/pairs/agreement.h"
#include "scan/pairs/material_labels.h"
#include "scan/votes/kit_lots.h"

namespace merl::scan {
namespace {

using List = std::vector<ApproximationDistances>;

/// Where in a list an approximation is.
std::optional<std::uint32_t> index_of(const List& list, const std::string& original,
                                      const std::string& approximation) {
    const auto key = [](const ApproximationDistances& row) {
        return std::tie(row.original, row.approximation);
    };
    const auto found = std::ranges::lower_bound(list, std::tie(original, approximation), {}, key);
    if (found == list.end() || key(*found) != std::tie(original, approximation)) {
        return std::nullopt;
    }
    return static_cast<std::uint32_t>(found - list.begin());
}

/// The indices of the approximations that are farthest under both metrics, `count` of them.
std::vector<std::uint32_t> farthest(const List& list, std::size_t count) {
    std::vector<double> first;
    std::vector<double> second;
    first.reserve(list.size());
    second.reserve(list.size());
    for (const auto& row : list) {
        first.push_back(row.first);
        second.push_back(row.second);
    }
    return smallest(farness(places_in_order(first), places_in_order(second)), count);
}

void add_sentinels(std::vector<KitTrial>& trials, const List& list, const KitPlan& plan) {
    Lots lots(plan.seed, Purpose::sentinels);
    auto candidates = farthest(list, sentinel_approximations(list.size()));
    lots.shuffle(candidates);
    std::set<std::string> taken;
    for (const auto candidate : candidates) {
        if (taken.size() == plan.sentinels) {
            return;
        }
        const auto& [original, approximation, first, second] = list[candidate];
        // What a metric cannot tell from the original is no sentinel.
        if (first == 0 || second == 0 || !taken.insert(original).second) {
            continue;
        }
        const bool left = lots.draw(2) == 0;
        trials.push_back({.configuration = trials.size() + 1,
                          .kind = TrialKind::sentinel,
                          .materials = {original, left ? original : approximation, original,
                                        left ? approximation : original},
                          .expected = static_cast<std::uint8_t>(left ? 1 : 3),
                          .agreement = std::nullopt});
    }
}

/// Where the approximations of each original begin, and where the last ones end.
std::vector<std::uint32_t> begins_of(const List& list) {
    std::vector<std::uint32_t> begins;
    for (std::uint32_t i = 0; i < list.size(); ++i) {
        if (i == 0 || list[i].original != list[i - 1].original) {
            begins.push_back(i);
        }
    }
    begins.push_back(static_cast<std::uint32_t>(list.size()));
    return begins;
}

void add_random(std::vector<KitTrial>& trials, const SelectionFile& selection, const List& list,
                const KitPlan& plan) {
    std::set<std::pair<std::uint32_t, std::uint32_t>> taken;
    for (const auto& row : selection.configurations) {
        const auto& m = row.materials;
        taken.insert(std::minmax(*index_of(list, m[0], m[1]), *index_of(list, m[2], m[3])));
    }
    const auto begins = begins_of(list);
    std::uint32_t most = 0;  // approximations of an original
    for (std::size_t i = 1; i < begins.size(); ++i) {
        most = std::max(most, begins[i] - begins[i - 1]);
    }
    Lots lots(plan.seed, Purpose::random);
    std::uint32_t added = 0;
    for (std::uint64_t draw = 0; draw < most_draws && added < plan.random && most > 1; ++draw) {
        // Any approximation, then a place among those of the same original: one that is not there
        // is drawn too, so that every two have the same chance.
        const auto a = static_cast<std::uint32_t>(lots.draw(list.size()));
        const auto begin = std::ranges::upper_bound(begins, a) - 1;
        const auto b = *begin + static_cast<std::uint32_t>(lots.draw(most));
        if (b >= *(begin + 1) || a == b ||
            !disagree(list[a].first, list[b].first, list[a].second, list[b].second) ||
            !taken.insert(std::minmax(a, b)).second) {
            continue;
        }
        const auto& [x, y] = std::pair(list[std::min(a, b)], list[std::max(a, b)]);
        const bool in_order = x.first < y.first || (x.first == y.first && x.second > y.second);
        const auto& left = in_order ? x : y;
        const auto& right = in_order ? y : x;
        trials.push_back(
            {.configuration = trials.size() + 1,
             .kind = TrialKind::random,
             .materials = {left.original, left.approximation, right.original, right.approximation},
             .expected = 0,
             .agreement = agreement(left.first, right.first, left.second, right.second)});
        ++added;
    }
}

}  // namespace

void expect_reference(const SelectionFile& selection, const std::string& reference) {
    for (std::size_t i = 0; i < selection.configurations.size(); ++i) {
        const auto& m = selection.configurations[i].materials;
        const auto original = labelled(m[0]);
        const auto approximates = [&](const std::string& material) {
            const auto other = labelled(material);
            return other.name == original.name && other.label != original.label;
        };
        if (original.label != reference || m[2] != m[0] || !approximates(m[1]) ||
            !approximates(m[3])) {
            throw InputError(fmt::format(
                "{}, row {}: found {} and {} against {} and {}; expected an original, \"{}/…\", "
                "first on both sides, each with an approximation of the same name, as the "
                "summary.json beside it says",
                selection.file, i + 1, m[0], m[1], m[2], m[3], reference));
        }
    }
}

void expect_same_scan(const SelectionFile& selection, const List& approximations,
                      const std::string& file) {
    for (std::size_t i = 0; i < selection.configurations.size(); ++i) {
        const auto& row = selection.configurations[i];
        for (std::size_t side = 0; side < 2; ++side) {
            const auto& original = row.materials[2 * side];
            const auto& approximation = row.materials[2 * side + 1];
            const auto index = index_of(approximations, original, approximation);
            if (!index) {
                throw InputError(
                    fmt::format("{}: there is no \"{}\" of the original \"{}\", which is in row "
                                "{} of {}; expected the approximations of the same scan",
                                file, approximation, original, i + 1, selection.file));
            }
            const auto& found = approximations[*index];
            if (found.first != row.first[side] || found.second != row.second[side]) {
                throw InputError(fmt::format(
                    "{}: \"{}\" is at {} and {} from the original, in row {} of {} at {} and {}; "
                    "expected the approximations of the same scan",
                    file, approximation, found.first, found.second, i + 1, selection.file,
                    row.first[side], row.second[side]));
            }
        }
    }
}

std::size_t sentinel_approximations(std::size_t approximations) {
    return std::min(approximations / 2, sentinel_pairs(approximations));
}

std::vector<KitTrial> plan_reference_kit(const SelectionFile& selection, const List& approximations,
                                         const KitPlan& plan) {
    auto trials = selection_trials(selection);
    if (approximations.empty() && (plan.sentinels > 0 || plan.random > 0)) {
        throw std::invalid_argument("sentinels and random disagreements need approximations");
    }
    if (plan.sentinels > 0) {
        add_sentinels(trials, approximations, plan);
    }
    if (plan.random > 0) {
        add_random(trials, selection, approximations, plan);
    }
    add_repeats(trials, plan);
    return trials;
}

FourMaterials reference_practice(const SelectionFile& selection) {
    const auto& rows = selection.configurations;
    const auto& original = rows.back().materials[0];
    const auto other =
        std::ranges::find_if(rows, [&](const auto& row) { return row.materials[0] != original; });
    return {original, original, original,
            (other == rows.end() ? rows.back() : *other).materials[1]};
}

}  // namespace merl::scan
