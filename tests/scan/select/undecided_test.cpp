#include "scan/select/undecided.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <random>
#include <stdexcept>

#include "scan/pairs/bounded_count.h"
#include "scan/pairs/count.h"
#include "scan/select/selection.h"
#include "tests/scan/approximate_distances.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::approximate;
using testing::errors;
using testing::make_distances;
using testing::near_ties;
using testing::Random;
using testing::random_cases;
using Indices = std::vector<std::uint32_t>;

constexpr double infinity = std::numeric_limits<double>::infinity();

void replace(const Indices& pairs, const std::vector<double>& exact, std::vector<double>& values,
             std::vector<double>& bounds) {
    EXPECT_TRUE(std::ranges::is_sorted(pairs, std::less_equal<>()));
    for (const auto pair : pairs) {
        EXPECT_GT(bounds[pair], 0) << "asked for an exact distance";
        values[pair] = exact[pair];
        bounds[pair] = 0;
    }
}

/// Refines until nothing is left to refine; returns in how many rounds.
int refine(Distances& distances, const Distances& exact, std::uint32_t select,
           std::uint32_t per_material, Decided decided = Decided::count_and_selection) {
    for (int rounds = 0; rounds < 1000; ++rounds) {
        const Refinement open = to_refine(distances, select, per_material, decided);
        if (open.empty()) {
            return rounds;
        }
        replace(open.first, exact.first, distances.first, distances.first_bounds);
        replace(open.second, exact.second, distances.second, distances.second_bounds);
    }
    return 1000;
}

bool meet(const std::vector<double>& values, const std::vector<double>& bounds, std::size_t a,
          std::size_t b) {
    return (bounds[a] > 0 || bounds[b] > 0) && values[a] - bounds[a] <= values[b] + bounds[b] &&
           values[b] - bounds[b] <= values[a] + bounds[a];
}

std::uint64_t plain_count_undecided(const Distances& d) {
    std::uint64_t count = 0;
    for (std::uint32_t a = 0; a < d.pairs(); ++a) {
        for (std::uint32_t b = a + 1; b < d.pairs(); ++b) {
            const bool undecided =
                meet(d.first, d.first_bounds, a, b) || meet(d.second, d.second_bounds, a, b);
            count += undecided ? 1 : 0;
        }
    }
    return count;
}

/// The inexact distances that meet another.
Indices plain_meeting(const std::vector<double>& values, const std::vector<double>& bounds) {
    Indices found;
    for (std::uint32_t a = 0; a < values.size(); ++a) {
        bool meets = false;
        for (std::uint32_t b = 0; b < values.size(); ++b) {
            meets |= a != b && bounds[a] > 0 && meet(values, bounds, a, b);
        }
        if (meets) {
            found.push_back(a);
        }
    }
    return found;
}

Indices pairs_of(const std::vector<Configuration>& configurations) {
    Indices pairs;
    for (const auto& c : configurations) {
        pairs.push_back(c.left);
        pairs.push_back(c.right);
    }
    std::ranges::sort(pairs);
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    return pairs;
}

Indices all_pairs(const Distances& distances) {
    Indices pairs(distances.pairs());
    std::iota(pairs.begin(), pairs.end(), 0U);
    return pairs;
}

/// Calls `body(exact, approximate)` for every kind of data and of errors.
void for_each_case(std::uint64_t seeds,
                   const std::function<void(const Distances&, const Distances&)>& body) {
    for (const auto& random_case : testing::cases_with_near_ties()) {
        for (const auto& error : errors()) {
            for (std::uint64_t seed = 0; seed < seeds; ++seed) {
                SCOPED_TRACE(
                    fmt::format("{}, errors {}, seed {}", random_case.name, error.name, seed));
                Random random(seed);
                const auto materials = static_cast<std::uint32_t>(2 + random() % 10);
                const Distances exact = random_case.make(materials, seed);
                body(exact, approximate(exact, error, random));
                if (::testing::Test::HasFailure()) {
                    return;
                }
            }
        }
    }
}

TEST(ToRefine, LeavesWhatExactDistancesDecide) {
    constexpr std::array<std::array<std::uint32_t, 2>, 7> limits{
        {{0, 10}, {1, 10}, {4, 1}, {7, 2}, {100, 10}, {5000, 5000}, {3, 0}}};
    int most_rounds = 0;
    for_each_case(25, [&](const Distances& exact, const Distances& approximate) {
        for (const auto& [select, per_material] : limits) {
            Distances refined = approximate;
            most_rounds = std::max(most_rounds, refine(refined, exact, select, per_material));
            ASSERT_EQ(count_by_streaming(refined), count_by_streaming(exact));
            ASSERT_EQ(count_undecided(refined), 0U);
            const auto chosen = select_configurations(refined, select, per_material);
            ASSERT_EQ(chosen, select_configurations(exact, select, per_material));
            for (const auto pair : pairs_of(chosen)) {  // every number of the table
                ASSERT_EQ(refined.first[pair], exact.first[pair]);
                ASSERT_EQ(refined.second[pair], exact.second[pair]);
            }
        }
    });
    RecordProperty("most_rounds", most_rounds);
    EXPECT_LE(most_rounds, 4);
}

TEST(ToRefine, AsksForWhatMeetsAnotherAndNoMore) {
    // Without a selection, and with errors that are not so large that a pair is refined anyway.
    for (const auto& random_case : testing::cases_with_near_ties()) {
        SCOPED_TRACE(random_case.name);
        for (std::uint64_t seed = 0; seed < 20; ++seed) {
            Random random(seed);
            const Distances d = approximate(random_case.make(9, seed), errors()[1], random);
            const Refinement open = to_refine(d, 0, 10);
            ASSERT_EQ(open.first, plain_meeting(d.first, d.first_bounds));
            ASSERT_EQ(open.second, plain_meeting(d.second, d.second_bounds));
        }
    }
}

TEST(ToRefine, AsksForTheSelectionWhereNothingIsClose) {
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        Random random(seed);
        const Distances exact = random_cases()[0].make(30, seed);
        Distances d = approximate(exact, {"", [](double v, Random&) { return 1e-13 * v; }}, random);
        const Indices expected = pairs_of(select_configurations(exact, 10, 3));
        ASSERT_LT(expected.size(), 21U);
        const Refinement open = to_refine(d, 10, 3);
        ASSERT_EQ(open.first, expected);
        ASSERT_EQ(open.second, expected);
        ASSERT_EQ(refine(d, exact, 10, 3), 1);
    }
}

/// What to_refine() has to leave when only the selection is wanted.
void expect_exact_selection(const Distances& refined, const Distances& exact, std::uint32_t select,
                            std::uint32_t per_material) {
    const auto chosen = select_configurations(refined, select, per_material);
    ASSERT_EQ(chosen, select_configurations(exact, select, per_material));
    for (const auto pair : pairs_of(chosen)) {
        ASSERT_EQ(refined.first[pair], exact.first[pair]);
        ASSERT_EQ(refined.second[pair], exact.second[pair]);
    }
    const auto bounded = bound_disagreements(refined);
    const auto count = count_by_streaming(exact).disagreements();
    ASSERT_LE(bounded.least, count);
    ASSERT_GE(bounded.greatest(), count);
}

TEST(ToRefine, TheSelectionAlone) {
    constexpr std::array<std::array<std::uint32_t, 2>, 6> limits{
        {{1, 10}, {4, 1}, {7, 2}, {100, 10}, {5000, 5000}, {3, 0}}};
    int most_rounds = 0;
    for_each_case(25, [&](const Distances& exact, const Distances& approximate) {
        for (const auto& [select, per_material] : limits) {
            Distances refined = approximate;
            most_rounds = std::max(
                most_rounds, refine(refined, exact, select, per_material, Decided::selection));
            expect_exact_selection(refined, exact, select, per_material);
        }
    });
    RecordProperty("most_rounds", most_rounds);
    EXPECT_LE(most_rounds, 20);
}

TEST(ToRefine, TheSelectionAloneOfMany) {
    for (const auto& random_case : testing::cases_with_near_ties()) {
        for (const auto& error : {errors()[1], errors()[3], errors()[5]}) {
            SCOPED_TRACE(random_case.name + ", errors " + error.name);
            const Distances exact = random_case.make(60, 3);
            Random random(2);
            Distances refined = approximate(exact, error, random);
            EXPECT_LE(refine(refined, exact, 20, 4, Decided::selection), 30);
            expect_exact_selection(refined, exact, 20, 4);
        }
    }
}

TEST(ToRefine, TheSelectionAloneAsksForLess) {
    const Distances exact = random_cases()[0].make(200, 3);
    Random random(2);
    const Distances d = approximate(exact, errors()[1], random);
    const auto all = to_refine(d, 10, 10);
    const auto few = to_refine(d, 10, 10, Decided::selection);
    EXPECT_GT(all.first.size(), 100U);  // so near to each other are they
    EXPECT_LT(few.first.size(), 40U);
    EXPECT_TRUE(std::ranges::includes(all.first, few.first));
    EXPECT_TRUE(std::ranges::includes(all.second, few.second));
}

TEST(ToRefine, ProgressMayEndIt) {
    Distances d = random_cases()[0].make(200, 3);
    d.first_bounds.assign(d.pairs(), 1e-6);
    d.second_bounds.assign(d.pairs(), 1e-6);
    for (const double end : {0.0, 0.4}) {
        const auto stop = [&](double share) {
            if (share >= end) {
                throw std::runtime_error("enough");
            }
        };
        EXPECT_THROW(to_refine(d, 10, 10, Decided::count_and_selection, stop), std::runtime_error);
    }
    const auto stop = [](double) { throw std::runtime_error("enough"); };
    EXPECT_THROW(select_configurations(d, 10, 10, stop), std::runtime_error);
}

TEST(ToRefine, AsksForNoneThatIsExact) {
    for (const auto& random_case : testing::cases_with_near_ties()) {
        SCOPED_TRACE(random_case.name);
        Distances d = random_case.make(9, 5);
        d.first_bounds.assign(d.pairs(), 0);
        d.second_bounds.assign(d.pairs(), 0);
        EXPECT_TRUE(to_refine(d, 100, 10).empty());
        EXPECT_EQ(count_undecided(d), 0U);
    }
}

TEST(ToRefine, AsksForEverythingWithoutBounds) {
    for (const auto& random_case : testing::cases_with_near_ties()) {
        SCOPED_TRACE(random_case.name);
        Distances d = random_case.make(9, 6);
        d.first_bounds.assign(d.pairs(), infinity);
        d.second_bounds.assign(d.pairs(), infinity);
        EXPECT_EQ(to_refine(d, 100, 10).first, all_pairs(d));
        EXPECT_EQ(to_refine(d, 0, 0).second, all_pairs(d));
        EXPECT_EQ(count_undecided(d), d.configurations());
        d.second_bounds.assign(d.pairs(), 0);
        EXPECT_EQ(count_undecided(d), d.configurations());
    }
}

TEST(CountUndecided, OfAThousandMaterialsWithoutBounds) {
    Distances d = random_cases()[0].make(1000, 7);
    d.first_bounds.assign(d.pairs(), infinity);
    d.second_bounds.assign(d.pairs(), 0);
    EXPECT_EQ(count_undecided(d), 124'749'875'250U);  // of 499,500 pairs
}

TEST(CountUndecided, OfAThousandMaterialsThatAllMeet) {
    // One by one that would be hours. All but the first pair are open under the second metric, and
    // the first is exact, apart and below them.
    Distances d = random_cases()[0].make(1000, 7);
    d.first.assign(d.pairs(), 1);
    d.second.assign(d.pairs(), 1);
    d.first_bounds.assign(d.pairs(), 1e-9);
    d.second_bounds.assign(d.pairs(), 1e-9);
    for (auto* values : {&d.first, &d.second}) {
        values->front() = 0.5;
    }
    d.first_bounds.front() = d.second_bounds.front() = 0;
    EXPECT_EQ(count_undecided(d), configuration_count(d.pairs() - 1));
    d.first_bounds.assign(d.pairs(), 0);  // now they tie there, and are no less open
    EXPECT_EQ(count_undecided(d), configuration_count(d.pairs() - 1));
    d.second_bounds.assign(d.pairs(), 0);
    EXPECT_EQ(count_undecided(d), 0U);
}

TEST(ToRefine, AnUnknownOneDragsInNoOthers) {
    // It could be anywhere, and so meets all; once it is exact it meets none.
    Distances d = random_cases()[0].make(9, 7);
    const auto with_bounds = [](const std::vector<double>& values) {
        std::vector<double> bounds;
        for (const double value : values) {
            bounds.push_back(1e-14 * value);
        }
        return bounds;
    };
    d.first_bounds = with_bounds(d.first);
    d.second_bounds = with_bounds(d.second);
    d.first_bounds[17] = infinity;
    EXPECT_EQ(count_undecided(d), d.pairs() - 1);
    EXPECT_EQ(to_refine(d, 0, 10).first, Indices{17});
    const Distances exact = d;
    EXPECT_LE(refine(d, exact, 1, 10), 2);
    EXPECT_LE(std::ranges::count(d.first_bounds, 0), 3);
}

TEST(ToRefine, OnePairIsNeverUndecided) {
    Distances d = make_distances({1}, {2});
    d.first_bounds = {0.5};
    d.second_bounds = {1e-9};
    EXPECT_EQ(count_undecided(d), 0U);
    EXPECT_LE(refine(d, make_distances({1}, {2}), 100, 10), 1);
}

TEST(ToRefine, IntervalsThatTouchAreUndecided) {
    // [0.75, 1.25] and [1.25, 1.75]; the third and, in the second metric, all are apart.
    Distances d = make_distances({1, 1.5, 4}, {1, 2, 3});
    d.first_bounds = {0.25, 0.25, 0};
    d.second_bounds = {0, 0, 0};
    EXPECT_EQ(count_undecided(d), 1U);
    EXPECT_EQ(to_refine(d, 0, 10).first, (Indices{0, 1}));
    EXPECT_TRUE(to_refine(d, 0, 10).second.empty());

    // An exact one at the end of an interval is not asked for.
    d.first = {1, 1.25, 4};
    d.first_bounds = {0.25, 0, 0};
    EXPECT_EQ(count_undecided(d), 1U);
    EXPECT_EQ(to_refine(d, 0, 10).first, (Indices{0}));

    // Exact ones that tie are decided.
    d.first = {1, 1, 4};
    d.first_bounds = {0, 0, 0};
    EXPECT_EQ(count_undecided(d), 0U);
    EXPECT_TRUE(to_refine(d, 0, 10).empty());
}

TEST(ToRefine, AWideIntervalMeetsThoseFarBehind) {
    for (const double scale : {1.0, 1e-4}) {  // with room to be refined first, or not
        SCOPED_TRACE(scale);
        std::vector<double> first;
        for (const double value : {4.0, 0.0, 1.0, 2.0, 3.0, 9.0}) {
            first.push_back(1 + scale * value);
        }
        Distances d = make_distances(std::move(first), {1, 2, 3, 4, 5, 6});
        d.first_bounds = {0, 3.5 * scale, 0.25 * scale, 0.25 * scale, 0.25 * scale, 1e-6};
        d.second_bounds.assign(6, 0);
        EXPECT_EQ(count_undecided(d), 3U);
        EXPECT_EQ(to_refine(d, 0, 10).first, (Indices{1, 2, 3, 4}));
    }
}

TEST(ToRefine, ManyCopiesTakeLittleTime) {
    // Three kinds of material: 3 * 10^6 configurations are as strong as the strongest.
    const std::uint32_t materials = 120;
    std::vector<double> first;
    std::vector<double> second;
    for (std::uint32_t i = 0; i < materials; ++i) {
        for (std::uint32_t j = i + 1; j < materials; ++j) {
            const std::uint32_t kinds = i % 3 == j % 3 ? 0 : i % 3 + j % 3;
            first.push_back(kinds);
            second.push_back(kinds == 0 ? 0 : 7 - kinds);
        }
    }
    const Distances exact = make_distances(std::move(first), std::move(second));
    Random random(1);
    Distances d = approximate(exact, errors()[1], random);
    EXPECT_LE(refine(d, exact, 100, 10), 2);
    EXPECT_EQ(select_configurations(d, 100, 10), select_configurations(exact, 100, 10));
}

TEST(ToRefine, WhatCouldComeBeforeTheSelected) {
    // All is exact but one distance, which meets no other. Pairs 1 and 3 have agreement 1 / 4;
    // pairs 2 and 3 have 1.005 / (2 * 2.0095), which is more, but could be less.
    const auto make = [](double open) {
        Distances d = make_distances({0.1, 1, 1.005, 2, 5, 6}, {0.1, 2, open, 1, 5, 6});
        d.first_bounds.assign(6, 0);
        d.second_bounds = {0, 0, 0.0018, 0, 0, 0};
        return d;
    };
    Distances d = make(2.0095);
    EXPECT_EQ(count_undecided(d), 0U);
    EXPECT_TRUE(to_refine(d, 0, 10).empty());
    EXPECT_TRUE(to_refine(d, 1, 10).first.empty());
    EXPECT_EQ(to_refine(d, 1, 10).second, Indices{2});
    EXPECT_EQ(select_configurations(d, 1, 10).front().left, 1U);
    const Distances exact = make(2.0105);
    EXPECT_EQ(refine(d, exact, 1, 10), 1);
    EXPECT_EQ(select_configurations(d, 1, 10).front().left, 2U);
    EXPECT_TRUE(to_refine(make(2.0075), 1, 10).empty());  // far enough behind
}

TEST(ToRefine, MoreThanAreCompared) {
    // The same, with 600 * 600 configurations between the strongest and the open one.
    std::vector<double> first;
    std::vector<double> second;
    for (std::uint32_t i = 0; i < pair_count(50); ++i) {
        const double step = i * 1e-9;
        first.push_back(i == 0 ? 1.005 : (i % 2 == 0 ? 1 : 2) + step);
        second.push_back(i == 0 ? 2.0098 : (i % 2 == 0 ? 2 : 1) + step);
    }
    Distances d = make_distances(std::move(first), std::move(second));
    d.first_bounds.assign(d.pairs(), 0);
    d.second_bounds.assign(d.pairs(), 0);
    d.second_bounds[0] = 0.0018;
    EXPECT_EQ(count_undecided(d), 0U);
    EXPECT_TRUE(to_refine(d, 1, 10).first.empty());
    EXPECT_EQ(to_refine(d, 1, 10).second, Indices{0});
    Distances exact = d;
    exact.second[0] = 2.0112;
    EXPECT_EQ(refine(d, exact, 1, 10), 1);
    EXPECT_EQ(select_configurations(d, 1, 10).front().left, 0U);
}

TEST(ToRefine, MoreAreSelectedThanAreComparedAtATime) {
    constexpr std::uint32_t kSelect = 300'000;  // of some 780,000 disagreements
    constexpr std::uint32_t kPerMaterial = 1'000'000;
    Random random(17);
    std::uniform_real_distribution<double> value(1, 2);
    std::vector<double> first(pair_count(60));
    std::vector<double> second(first.size());
    std::ranges::generate(first, [&] { return value(random); });
    std::ranges::generate(second, [&] { return value(random); });
    const Distances exact = make_distances(std::move(first), std::move(second));
    Distances d = approximate(exact, {"", [](double v, Random&) { return 1e-6 * v; }}, random);
    refine(d, exact, kSelect, kPerMaterial, Decided::selection);
    const auto selected = select_configurations(d, kSelect, kPerMaterial);
    const auto expected = select_configurations(exact, kSelect, kPerMaterial);
    ASSERT_EQ(selected.size(), kSelect);
    EXPECT_TRUE(
        std::ranges::equal(selected, expected, {}, &Configuration::left, &Configuration::left));
    EXPECT_TRUE(
        std::ranges::equal(selected, expected, {}, &Configuration::right, &Configuration::right));
    EXPECT_TRUE(std::ranges::equal(selected, expected, {}, &Configuration::agreement,
                                   &Configuration::agreement));
}

TEST(ToRefine, WithoutBoundsAllAreExact) {
    Distances d = make_distances({1, 2, 3}, {3, 2, 1});
    EXPECT_TRUE(to_refine(d, 1, 1).empty());
    d.first_bounds = {0, 0, 0};
    EXPECT_TRUE(to_refine(d, 1, 1).empty());
    d.first_bounds = {1e-3, 0, 0};
    EXPECT_EQ(to_refine(d, 1, 1).first, Indices{0});
    d.first_bounds = {0, 0, 0};
    d.second_bounds = {0, 0, 0};
    EXPECT_TRUE(to_refine(d, 1, 1).empty());
    EXPECT_EQ(count_undecided(make_distances({1, 2, 3}, {3, 2, 1})), 0U);
}

TEST(CountUndecided, AsOneByOne) {
    for_each_case(40, [](const Distances&, const Distances& approximate) {
        ASSERT_EQ(count_undecided(approximate), plain_count_undecided(approximate));
    });
}

/// Distances under a final metric beside exact ones; list_undecided() is of the final.
Distances with_final(std::vector<double> values, std::vector<double> bounds) {
    Distances d = make_distances(values, values);
    d.first_bounds.assign(d.pairs(), 0);
    d.second_bounds = std::move(bounds);
    d.second_is_final = true;
    return d;
}

TEST(ListUndecided, AsOneByOne) {
    Random random(3);
    for (int i = 0; i < 200; ++i) {
        std::vector<double> values;
        std::vector<double> bounds;
        for (std::uint64_t pair = 0; pair < pair_count(9); ++pair) {
            values.push_back(static_cast<double>(1 + random() % 6));
            bounds.push_back(0.25 * static_cast<double>(random() % 5));
        }
        const Distances d = with_final(values, bounds);
        std::vector<std::array<std::uint32_t, 2>> expected;
        for (std::uint32_t a = 0; a < d.pairs(); ++a) {
            for (std::uint32_t b = a + 1; b < d.pairs(); ++b) {
                if (values[a] != values[b] &&
                    std::abs(values[a] - values[b]) <= bounds[a] + bounds[b]) {
                    expected.push_back({a, b});
                }
            }
        }
        std::vector<std::array<std::uint32_t, 2>> found;
        for (const auto& open : list_undecided(d, 10'000)) {
            EXPECT_EQ(open.metric, d.second_metric);
            found.push_back({open.left, open.right});
        }
        std::ranges::sort(found);
        EXPECT_EQ(found, expected);
        EXPECT_EQ(found.size(), count_undecided(d));
        EXPECT_EQ(list_undecided(d, 7).size(), std::min<std::size_t>(7, expected.size()));
    }
}

TEST(ListUndecided, OfAMillionPairsThatTie) {
    // One by one that would be hours.
    constexpr std::uint32_t materials = 1415;
    std::vector<double> values(pair_count(materials), 0.0);
    values.back() = 1;
    Distances d = with_final(values, std::vector<double>(values.size(), 1e-13));
    EXPECT_TRUE(list_undecided(d, 1000).empty());
    d.second.back() = 1.5e-13;
    const auto last = static_cast<std::uint32_t>(d.pairs() - 1);
    const auto open = list_undecided(d, 1000);
    ASSERT_EQ(open.size(), 1000U);
    EXPECT_EQ(open[999], (OpenConfiguration{999, last, d.second_metric}));
    EXPECT_EQ(count_undecided(d), d.pairs() - 1);
}

}  // namespace
}  // namespace merl::scan
