#include "scan/reference/reference_scan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "scan/reference/reference_summary.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

/// Originals o/0, o/1 ... with so many approximations each, of labels around theirs in the
/// alphabet, under three metrics.
ReferenceDistances make(std::size_t originals, std::size_t labels, std::uint64_t seed,
                        const std::function<double(std::mt19937_64&)>& value,
                        double lacking = 0.1) {
    std::mt19937_64 random(seed);
    std::vector<std::string> names;
    for (std::size_t o = 0; o < originals; ++o) {
        names.push_back("o/" + std::to_string(o));
        for (std::size_t label = 0; label < labels; ++label) {
            if (o == 0 || std::uniform_real_distribution()(random) >= lacking) {
                names.push_back(std::string(1, static_cast<char>('l' + 2 * label)) + "/" +
                                std::to_string(o));
            }
        }
    }
    std::ranges::sort(names);
    auto approximations = find_approximations(names, "o");
    ListedDistances table{names, pairs_of(approximations), {}};
    for (const auto* const metric : {"one", "two", "three"}) {
        auto& column = table.metrics.emplace_back(MetricColumn{metric, {}, {}, false});
        for (std::size_t i = 0; i < table.pairs.size(); ++i) {
            column.values.push_back(value(random));
        }
    }
    return reference_distances(std::move(table), std::move(approximations));
}

double plain(std::mt19937_64& random) {
    return std::lognormal_distribution(0.0, 1.0)(random);
}

/// Few values: ties, and zeros.
double coarse(std::mt19937_64& random) {
    return static_cast<double>(std::uniform_int_distribution(0, 3)(random));
}

/// Values that nearly tie.
double close(std::mt19937_64& random) {
    return 1 + 1e-6 * static_cast<double>(std::uniform_int_distribution(0, 9)(random));
}

/// Moves distances within bounds that it makes up: of these a share is exact, and a share loose.
ReferenceDistances blurred(ReferenceDistances distances, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution uniform(-1.0, 1.0);
    for (auto& column : distances.table.metrics) {
        for (auto& value : column.values) {
            const double kind = uniform(random);
            const double relative = kind < -0.8 ? 0 : kind > 0.9 ? 0.3 : 3e-6;
            const double bound = relative * (value + 0.1);
            value = std::max(0.0, value + 0.99 * bound * uniform(random));
            column.bounds.push_back(bound);
        }
    }
    return distances;
}

/// Refines until nothing is asked for; returns how many distances that took.
std::size_t refine(ReferenceDistances& distances, const ReferenceDistances& exact,
                   std::uint32_t select, std::uint32_t per_material) {
    std::size_t refined = 0;
    for (int round = 0; round < 50; ++round) {
        const auto open = to_refine(distances, {true, true, true}, select, per_material);
        std::size_t asked = 0;
        for (std::size_t m = 0; m < 3; ++m) {
            auto& column = distances.table.metrics[m];
            for (const auto pair : open[m]) {
                EXPECT_GT(column.bounds[pair], 0);
                column.values[pair] = exact.table.metrics[m].values[pair];
                column.bounds[pair] = 0;
                ++asked;
            }
        }
        if (asked == 0) {
            return refined;
        }
        refined += asked;
    }
    ADD_FAILURE() << "still open";
    return refined;
}

TEST(ReferenceScan, WhatIsRefinedDecidesAsExactDistancesDo) {
    std::size_t refined = 0;
    std::size_t all = 0;
    for (const auto value : {plain, coarse, close}) {
        for (std::uint64_t seed = 0; seed < 60; ++seed) {
            const auto exact = make(12, 1 + seed % 6, seed, value);
            for (const auto& [select, per_material] :
                 {std::pair(1U, 10U), {5U, 2U}, {1000U, 3U}, {1000U, 1000U}}) {
                SCOPED_TRACE(::testing::Message()
                             << "seed " << seed << ", " << select << ", " << per_material);
                auto distances = blurred(exact, seed + 1000);
                refined += refine(distances, exact, select, per_material);
                all += 3 * exact.pairs.size();
                const auto disagreements = disagreements_of(exact);
                ASSERT_EQ(select_of(distances, disagreements_of(distances), select, per_material),
                          select_of(exact, disagreements, select, per_material));
                for (std::size_t m = 0; m < 3; ++m) {
                    ASSERT_EQ(ranks_of(distances, m), ranks_of(exact, m));
                    for (std::size_t other = m + 1; other < 3; ++other) {
                        ASSERT_EQ(count_configurations(distances, m, other),
                                  count_configurations(exact, m, other));
                    }
                    const auto hardest = summarise(distances, 5).metrics[m].hardest;
                    const auto expected = summarise(exact, 5).metrics[m].hardest;
                    ASSERT_EQ(hardest.size(), expected.size());
                    for (std::size_t i = 0; i < hardest.size(); ++i) {
                        ASSERT_EQ(hardest[i].original, expected[i].original);
                        ASSERT_EQ(hardest[i].label, expected[i].label);
                    }
                }
                ASSERT_EQ(find_undecided(distances, 10).configurations, 0U);
            }
        }
    }
    EXPECT_LT(refined, all * 9 / 10) << "little was left out";
}

TEST(ReferenceScan, WhatCannotBeRefinedIsNotAskedFor) {
    const auto exact = make(10, 4, 5, close);
    const auto distances = blurred(exact, 6);
    const auto open = to_refine(distances, {true, false, true}, 100, 10);
    EXPECT_FALSE(open[0].empty());
    EXPECT_TRUE(open[1].empty());
    EXPECT_FALSE(open[2].empty());
    auto with_final = distances;
    with_final.table.metrics[2].is_final = true;
    EXPECT_TRUE(to_refine(with_final, {true, true, true}, 100, 10)[2].empty());
    EXPECT_THROW(to_refine(exact, {true, true, true}, 100, 10), std::invalid_argument);
}

TEST(ReferenceScan, UndecidedAreTheConfigurationsWhoseDistancesMeet) {
    // One original with three approximations, so three configurations.
    auto distances = make(1, 3, 1, plain, 0);
    auto& metrics = distances.table.metrics;
    const auto set = [&](std::size_t m, std::vector<double> values, std::vector<double> bounds) {
        metrics[m].values = std::move(values);
        metrics[m].bounds = std::move(bounds);
    };
    set(0, {1, 2, 4}, {0.5, 0.5, 0.1});  // the first two meet, just
    set(1, {1, 1, 1}, {0, 0, 0});        // ties
    set(2, {1, 2, 3}, {0, 0, 0});
    EXPECT_EQ(find_undecided(distances, 10).configurations, 1U);
    EXPECT_TRUE(find_undecided(distances, 10).open.empty()) << "only final distances are listed";
    set(2, {1, 2, 3}, {0.1, 0.6, 0.5});  // the last two meet
    EXPECT_EQ(find_undecided(distances, 10).configurations, 2U);
    metrics[2].is_final = true;
    const std::vector<OpenConfiguration> open = {{1, 2, "three"}};
    EXPECT_EQ(find_undecided(distances, 10).open, open);
    EXPECT_TRUE(find_undecided(distances, 0).open.empty());
    set(2, {1, 1, 3}, {0.1, 0.1, 0.1});
    EXPECT_EQ(find_undecided(distances, 10).configurations, 1U) << "final ones tie";
    metrics[2].is_final = false;
    set(2, {5, 1, 1}, {0.1, 0, 0.1});
    EXPECT_EQ(find_undecided(distances, 10).configurations, 2U) << "equal but not exact";
    set(2, {5, 1, 1}, {0.1, 0, 0});
    set(0, {1, 2, 4}, {});
    EXPECT_EQ(find_undecided(distances, 10).configurations, 0U) << "without bounds all are exact";
}

TEST(ReferenceScan, DistancesOfOtherPairsAreRefused) {
    auto distances = make(3, 3, 1, plain);
    auto table = distances.table;
    table.pairs.pop_back();
    EXPECT_THROW(reference_distances(table, distances.approximations), std::invalid_argument);
}

}  // namespace
}  // namespace merl::scan
