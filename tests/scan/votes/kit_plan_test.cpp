#include "scan/votes/kit_plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <set>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/pairs/agreement.h"
#include "scan/select/disagreement_search.h"
#include "scan/select/selection.h"

namespace merl::scan {
namespace {

using ::testing::HasSubstr;

Distances made_up(std::uint32_t materials, std::uint32_t seed) {
    Distances d;
    d.first_metric = "x";
    d.second_metric = "y";
    std::mt19937 random(seed);
    for (std::uint32_t i = 0; i < materials; ++i) {
        d.names.push_back(fmt::format("m{}", 1000 + i));
    }
    for (std::uint64_t i = 0; i < pair_count(materials); ++i) {
        const double common = 1 + static_cast<double>(random() % 1000);
        d.first.push_back(common * (1 + static_cast<double>(random() % 100) / 50));
        d.second.push_back(common * (1 + static_cast<double>(random() % 100) / 50));
    }
    return d;
}

SelectionFile select_from(const Distances& d, std::uint32_t count) {
    SelectionFile file{
        .file = "selection.csv", .first_metric = "x", .second_metric = "y", .configurations = {}};
    for (const auto& c : select_configurations(d, count, 10)) {
        const Pair l = pair_at(c.left, d.materials());
        const Pair r = pair_at(c.right, d.materials());
        file.configurations.push_back({.materials = {d.names[l.first], d.names[l.second],
                                                     d.names[r.first], d.names[r.second]},
                                       .first = {d.first[c.left], d.first[c.right]},
                                       .second = {d.second[c.left], d.second[c.right]},
                                       .agreement = c.agreement});
    }
    return file;
}

/// The index of a pair by looking at all.
std::uint32_t find_pair(const Distances& d, const std::string& one, const std::string& other) {
    for (std::uint32_t i = 0; i < d.pairs(); ++i) {
        const Pair p = pair_at(i, d.materials());
        if (std::set{d.names[p.first], d.names[p.second]} == std::set{one, other}) {
            return i;
        }
    }
    throw std::logic_error("no such pair");
}

std::vector<KitTrial> of_kind(const std::vector<KitTrial>& trials, TrialKind kind) {
    std::vector<KitTrial> found;
    std::ranges::copy_if(trials, std::back_inserter(found),
                         [&](const auto& trial) { return trial.kind == kind; });
    return found;
}

TEST(KitPlan, HasTheSelectionAndWhatWasAskedFor) {
    const auto d = made_up(40, 1);
    const auto selection = select_from(d, 25);
    const auto trials =
        plan_kit(selection, &d, {.seed = 7, .repeats = 10, .sentinels = 4, .random = 6});
    ASSERT_EQ(trials.size(), 25U + 4 + 6 + 3);  // 2.5 repeats, rounded up
    for (std::size_t i = 0; i < 35; ++i) {
        EXPECT_EQ(trials[i].configuration, i + 1);
    }
    for (std::size_t i = 0; i < 25; ++i) {
        EXPECT_EQ(trials[i].kind, TrialKind::selection);
        EXPECT_EQ(trials[i].materials, selection.configurations[i].materials);
        EXPECT_EQ(trials[i].agreement, selection.configurations[i].agreement);
    }
    std::set<std::uint64_t> repeated;
    for (const auto& repeat : of_kind(trials, TrialKind::repeat)) {
        ASSERT_LE(repeat.configuration, 25U);
        EXPECT_TRUE(repeated.insert(repeat.configuration).second);
        EXPECT_EQ(repeat.materials, trials[repeat.configuration - 1].materials);
    }
}

TEST(KitPlan, SentinelsAreWhereBothMetricsAgreeStrongly) {
    const auto d = made_up(60, 2);
    const auto selection = select_from(d, 10);
    auto sorted = [](std::vector<double> values) {
        std::ranges::sort(values);
        return values;
    };
    const auto first = sorted(d.first);
    const auto second = sorted(d.second);
    std::set<int> expected;
    for (std::uint64_t seed = 0; seed < 5; ++seed) {
        const auto sentinels = of_kind(
            plan_kit(selection, &d, {.seed = seed, .repeats = 0, .sentinels = 5, .random = 0}),
            TrialKind::sentinel);
        ASSERT_EQ(sentinels.size(), 5U);
        std::set<std::string> seen;
        for (const auto& s : sentinels) {
            const auto left = find_pair(d, s.materials[0], s.materials[1]);
            const auto right = find_pair(d, s.materials[2], s.materials[3]);
            const auto [close, far] =
                s.expected == 1 ? std::pair(left, right) : std::pair(right, left);
            // Among 1,770 pairs, 35 have the largest of their two ranks below this.
            const std::size_t many = first.size() / 4;
            EXPECT_LE(d.first[close], first[many]);
            EXPECT_LE(d.second[close], second[many]);
            EXPECT_GE(d.first[far], first[first.size() - many]);
            EXPECT_GE(d.second[far], second[second.size() - many]);
            for (const auto& material : s.materials) {
                EXPECT_TRUE(seen.insert(material).second) << material;
            }
            EXPECT_FALSE(s.agreement.has_value());
            expected.insert(s.expected);
        }
    }
    EXPECT_EQ(expected, (std::set{1, 3}));
}

TEST(KitPlan, SentinelsAreFromTwoPercentOrTwentyPairs) {
    EXPECT_EQ(sentinel_pairs(4950), 99U);  // of 100 materials
    EXPECT_EQ(sentinel_pairs(1050), 21U);
    EXPECT_EQ(sentinel_pairs(1000), 20U);
    EXPECT_EQ(sentinel_pairs(190), 20U);  // of 20: a tenth
    EXPECT_EQ(sentinel_pairs(6), 6U);
    // What is drawn is among so many under the worse of both ranks.
    const auto d = made_up(40, 1);
    const auto count = sentinel_pairs(d.pairs());
    const auto rank = [&](const std::vector<double>& values, std::uint32_t pair) {
        return std::ranges::count_if(values, [&](double v) { return v < values[pair]; });
    };
    std::vector<long> worse;
    for (std::uint32_t pair = 0; pair < d.pairs(); ++pair) {
        worse.push_back(std::max(rank(d.first, pair), rank(d.second, pair)));
    }
    auto sorted = worse;
    std::ranges::sort(sorted);
    for (std::uint64_t seed = 0; seed < 20; ++seed) {
        for (const auto& s :
             of_kind(plan_kit(select_from(d, 2), &d,
                              {.seed = seed, .repeats = 0, .sentinels = 5, .random = 0}),
                     TrialKind::sentinel)) {
            const std::size_t side = s.expected == 1 ? 0 : 2;
            const auto close = find_pair(d, s.materials.at(side), s.materials.at(side + 1));
            EXPECT_LE(worse[close], sorted[count - 1]);
        }
    }
}

TEST(KitPlan, RandomOnesAreOtherDisagreementsWithEqualChances) {
    const auto d = made_up(6, 3);  // 105 configurations
    const auto selection = select_from(d, 2);
    DisagreementSearch search(d);
    std::uint32_t disagreements = 0;
    while (search.next()) {
        ++disagreements;
    }
    ASSERT_GT(disagreements, 12U);
    // All there are but those of the selection, when more are asked for.
    const auto all =
        of_kind(plan_kit(selection, &d, {.seed = 1, .repeats = 0, .sentinels = 0, .random = 1000}),
                TrialKind::random);
    EXPECT_EQ(all.size(), disagreements - 2);
    std::map<FourMaterials, int> times;
    constexpr int kSeeds = 4000;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const auto one = plan_kit(
            selection, &d,
            {.seed = static_cast<std::uint64_t>(seed), .repeats = 0, .sentinels = 0, .random = 1});
        const auto& trial = one.back();
        ++times[trial.materials];
        const auto l = find_pair(d, trial.materials[0], trial.materials[1]);
        const auto r = find_pair(d, trial.materials[2], trial.materials[3]);
        ASSERT_TRUE(disagree(d.first[l], d.first[r], d.second[l], d.second[r]));
        ASSERT_LE(d.first[l], d.first[r]);
        ASSERT_GE(d.second[l], d.second[r]);
    }
    // Chi-squared: mean n - 1, variance 2 (n - 1); five deviations.
    const auto n = static_cast<double>(all.size());
    double chi2 = 0;
    for (const auto& [materials, count] : times) {
        chi2 += std::pow(count - kSeeds / n, 2) / (kSeeds / n);
    }
    EXPECT_EQ(times.size(), all.size());
    EXPECT_LT(chi2, n - 1 + 5 * std::sqrt(2 * (n - 1)));
}

TEST(KitPlan, OneOptionDoesNotChangeWhatAnotherDraws) {
    const auto d = made_up(30, 4);
    const auto selection = select_from(d, 20);
    const auto plan = [&](std::uint64_t seed, std::uint32_t sentinels) {
        return plan_kit(selection, &d,
                        {.seed = seed, .repeats = 20, .sentinels = sentinels, .random = 5});
    };
    const auto names = [&](const std::vector<KitTrial>& trials, TrialKind kind) {
        std::vector<FourMaterials> list;
        for (const auto& trial : of_kind(trials, kind)) {
            list.push_back(trial.materials);
        }
        return list;
    };
    for (const auto kind : {TrialKind::random, TrialKind::repeat}) {
        EXPECT_EQ(names(plan(1, 0), kind), names(plan(1, 3), kind));
        EXPECT_NE(names(plan(1, 3), kind), names(plan(2, 3), kind));
    }
    EXPECT_NE(names(plan(1, 3), TrialKind::sentinel), names(plan(2, 3), TrialKind::sentinel));
}

TEST(KitPlan, NeedsDistancesOnlyForWhatIsDrawnFromThem) {
    const auto d = made_up(10, 5);
    const auto selection = select_from(d, 4);
    EXPECT_EQ(plan_kit(selection, nullptr, {.seed = 1, .repeats = 100, .sentinels = 0, .random = 0})
                  .size(),
              8U);
    EXPECT_THROW(plan_kit(selection, nullptr, {}), std::invalid_argument);
}

TEST(KitPlan, DistancesOfAnotherScanAreRefused) {
    auto d = made_up(10, 6);
    auto selection = select_from(d, 3);
    expect_same_scan(selection, d, "pairs.csv");
    const auto complaint = [&] {
        try {
            expect_same_scan(selection, d, "pairs.csv");
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    selection.configurations[1].second[0] *= 1.5;
    EXPECT_THAT(complaint(), ::testing::AllOf(HasSubstr("pairs.csv"), HasSubstr("row 2")));
    selection.configurations[0].materials[3] = "nope";
    EXPECT_THAT(complaint(), ::testing::AllOf(HasSubstr("\"nope\""), HasSubstr("row 1")));
}

}  // namespace
}  // namespace merl::scan
