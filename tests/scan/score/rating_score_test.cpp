#include "scan/score/rating_score.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <string>
#include <tuple>
#include <vector>

namespace merl::scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kInfinity = std::numeric_limits<double>::infinity();

MetricColumn column(std::vector<double> values, std::vector<double> bounds, bool is_final = false) {
    return {"m", std::move(values), std::move(bounds), is_final};
}

TEST(OpenPlaces, WhereAnotherDistanceMayBeTheSame) {
    EXPECT_THAT(open_places(column({1, 2, 3}, {})), IsEmpty());
    EXPECT_THAT(open_places(column({1, 2, 3}, {0.4, 0.4, 0.4})), IsEmpty());
    EXPECT_THAT(open_places(column({3, 1, 2}, {0.5, 0.5, 0.5})), ElementsAre(0, 1, 2));
    EXPECT_THAT(open_places(column({3, 1, 1.5}, {0.5, 0.25, 0.25})), ElementsAre(1, 2));
    // A wide one meets those that are not beside it; an exact one has nothing to refine.
    EXPECT_THAT(open_places(column({1, 2, 3, 4, 9}, {0, 0.1, 0.1, 2.5, 0.1})),
                ElementsAre(1, 2, 3));
    EXPECT_THAT(open_places(column({1, 1}, {0, 0})), IsEmpty());
    EXPECT_THAT(open_places(column({1, 1, 5}, {0.1, 0, 0.1})), ElementsAre(0));
    // Equal distances of a summary tie.
    EXPECT_THAT(open_places(column({1, 1, 5}, {0.1, 0.1, 0.1}, true)), IsEmpty());
    EXPECT_THAT(open_places(column({1, 1, 1.1}, {0.1, 0.1, 0.1}, true)), ElementsAre(0, 1, 2));
    EXPECT_THAT(open_places(column({1, 2, 30}, {kInfinity, kInfinity, kInfinity})),
                ElementsAre(0, 1, 2));
}

TEST(OpenPlaces, AsComparingAllOfThemFinds) {
    std::mt19937_64 random(5);
    for (int round = 0; round < 200; ++round) {
        std::vector<double> values;
        std::vector<double> bounds;
        for (int i = 0; i < 30; ++i) {
            values.push_back(static_cast<double>(random() % 400));
            bounds.push_back(static_cast<double>(random() % 4 == 0 ? random() % 12 : random() % 3));
        }
        // Those with the same distance share the largest of their bounds.
        const auto bound = [&](std::uint32_t i) {
            double largest = 0;
            for (std::uint32_t j = 0; j < values.size(); ++j) {
                largest = values[i] == values[j] ? std::max(largest, bounds[j]) : largest;
            }
            return largest;
        };
        std::vector<std::uint32_t> expected;
        for (std::uint32_t i = 0; i < values.size(); ++i) {
            bool open = false;
            for (std::uint32_t j = 0; j < values.size(); ++j) {
                open |= i != j && std::abs(values[i] - values[j]) <= bound(i) + bound(j);
            }
            if (open && bounds[i] > 0) {
                expected.push_back(i);
            }
        }
        const auto found = open_places(column(values, bounds));
        EXPECT_EQ(found, expected);
        EXPECT_LT(found.size(), values.size());
    }
}

/// Ratings of `originals` materials by `methods` approximations, in a table with all of them; the
/// rating and the distances come from functions of both numbers.
struct Study {
    template <typename Rating, typename... Distance>
    Study(std::uint32_t originals, std::uint32_t methods, const Rating& rating,
          const Distance&... distance) {
        std::string text = "original,approximation,rating\n";
        for (std::uint32_t o = 0; o < originals; ++o) {
            table.names.push_back(fmt::format("a/{:02}", o));
            for (std::uint32_t m = 0; m < methods; ++m) {
                text += fmt::format("{:02},m{},{}\n", o, m, rating(o, m));
            }
        }
        for (std::uint32_t m = 0; m < methods; ++m) {
            for (std::uint32_t o = 0; o < originals; ++o) {
                table.names.push_back(fmt::format("m{}/{:02}", m, o));
            }
        }
        ratings = resolve_ratings(parse_ratings(text, "r.csv"), {.reference = "a"}, table.names);
        table.pairs = rated_pairs(ratings);
        const auto add = [&](const auto& of) {
            MetricColumn metric = {fmt::format("d{}", table.metrics.size()), {}, {}};
            for (const auto& pair : table.pairs) {
                const auto m = (pair.second - originals) / originals;
                metric.values.push_back(of(pair.first, m));
            }
            table.metrics.push_back(metric);
        };
        (add(distance), ...);
    }

    RatingScore score(std::optional<double> apart = std::nullopt) const {
        return score_ratings(ratings, table, apart);
    }

    Ratings ratings{};
    ListedDistances table;
};

// A metric that is right, one that is always wrong, and one that says nothing.
TEST(RatingScore, RightWrongAndSilent) {
    const auto quality = [](std::uint32_t o, std::uint32_t m) { return (7 * o + 3 * m) % 40; };
    const Study study(
        8, 4, quality, [&](auto o, auto m) { return std::exp(-0.1 * quality(o, m)); },
        [&](auto o, auto m) { return 1.0 * quality(o, m); }, [](auto, auto) { return 2.0; });
    const auto score = study.score();
    ASSERT_EQ(score.metrics.size(), 3U);
    const auto& [right, wrong, silent] =
        std::tie(score.metrics[0].figures, score.metrics[1].figures, score.metrics[2].figures);
    for (const auto& [figures, correlation, share] :
         {std::tuple(right, 1.0, 1.0), {wrong, -1.0, 0.0}}) {
        EXPECT_EQ(figures.spearman.value, correlation);
        EXPECT_EQ(figures.kendall.value, correlation);
        EXPECT_EQ(figures.pairs.value, share);
        EXPECT_EQ(figures.pairs_apart.value, share);
        // No original differs from the others.
        EXPECT_THAT(figures.spearman.too_few, HasSubstr("alike"));
        EXPECT_THAT(figures.pairs.too_few, HasSubstr("alike"));
    }
    EXPECT_TRUE(std::isnan(silent.spearman.value));
    EXPECT_EQ(silent.pairs.value, 0.5);
    EXPECT_EQ(score.metrics[2].ties, score.pairs.observations);
    EXPECT_EQ(score.pairs.observations, 48U);
    EXPECT_THAT(best_first(score), ElementsAre(0, 2, 1));
    ASSERT_EQ(score.differences.size(), 6U);
    EXPECT_EQ(score.differences[0].pairs.estimate.value, 1);
    EXPECT_EQ(score.differences[0].spearman.estimate.value, 2);
    EXPECT_TRUE(std::isnan(score.differences[0].pairs.p_holm));
}

TEST(RatingScore, DifferencesTurnTheOrder) {
    const auto worse = [](std::uint32_t o, std::uint32_t m) { return (5 * o + m * m) % 13; };
    Study study(6, 3, worse, [&](auto o, auto m) { return 1.0 * worse(o, m); });
    EXPECT_EQ(study.score().metrics[0].figures.spearman.value, -1);
    study.ratings.higher_is_better = false;
    const auto score = study.score();
    EXPECT_EQ(score.metrics[0].figures.spearman.value, 1);
    EXPECT_EQ(score.metrics[0].figures.pairs.value, 1);
}

TEST(RatingScore, WhatIsApart) {
    // Ratings 0.1, 0.2, 0.3 ...: neighbours differ by a tenth as decimals, more or less in float64.
    const auto rating = [](std::uint32_t, std::uint32_t m) { return fmt::format("0.{}", m + 1); };
    const Study study(5, 4, rating, [](auto, auto m) { return 9.0 - m; });
    EXPECT_EQ(study.score(0.1).pairs_apart.observations, 15U);
    EXPECT_EQ(study.score(0.0999).pairs_apart.observations, 30U);
    EXPECT_NEAR(study.score().apart, 0.03, 1e-15);
    EXPECT_EQ(study.score(3).pairs_apart.observations, 0U);
    EXPECT_TRUE(std::isnan(study.score(3).metrics[0].figures.pairs_apart.value));
}

// By hand: original 0 has m0 5, m1 3; 1 has m0 4, m1 2; 2 has m0 1 and m2 6.
TEST(RatingScore, WhatANameAlonePredicts) {
    const std::vector<std::string> names = {"a/0",  "a/1",  "a/2",  "m0/0", "m0/1",
                                            "m0/2", "m1/0", "m1/1", "m2/2"};
    const auto file = parse_ratings(
        "original,approximation,rating\n0,m0,5\n0,m1,3\n1,m0,4\n1,m1,2\n2,m0,1\n2,m2,6\n", "r.csv");
    const auto ratings = resolve_ratings(file, {.reference = "a"}, names);
    const auto pairs = rated_pairs(ratings);
    const ListedDistances table = {names, pairs, {{"d", {1, 2, 3, 4, 5, 6}, {}}}};
    const auto score = score_ratings(ratings, table);
    ASSERT_TRUE(score.name_alone);
    const auto& name = *score.name_alone;
    ASSERT_EQ(name.predicted.size(), 6U);
    EXPECT_EQ(name.predicted[0], 2.5);
    EXPECT_EQ(name.predicted[1], 2);
    EXPECT_EQ(name.predicted[2], 3);
    EXPECT_EQ(name.predicted[3], 3);
    EXPECT_EQ(name.predicted[4], 4.5);
    EXPECT_TRUE(std::isnan(name.predicted[5]));
    EXPECT_EQ(name.approximations, 5U);
    EXPECT_EQ(name.originals, 3U);
    // m0 before m1 with original 0, a tie with 1, no pair with 2.
    EXPECT_EQ(name.figures.pairs.value, 0.75);
    // It does not predict everything, so nothing is compared with it.
    EXPECT_THAT(score.differences, IsEmpty());
    // Without names that occur again there is none.
    const std::vector<std::string> plain = {"g", "g1", "g2"};
    const auto others = resolve_ratings(
        parse_ratings("original,approximation,rating\ng,g1,5\ng,g2,3\n", "r.csv"), {}, plain);
    EXPECT_FALSE(
        score_ratings(others, {plain, rated_pairs(others), {{"d", {1, 2}, {}}}}).name_alone);
}

TEST(RatingScore, DoubtsAreSaid) {
    const auto rating = [](std::uint32_t o, std::uint32_t m) { return o + m; };
    const Study few(4, 2, rating, [](auto o, auto m) { return 9.0 - o - m; });
    const auto doubts = few.score().doubts;
    ASSERT_EQ(doubts.size(), 3U);
    EXPECT_THAT(doubts[0], HasSubstr("no intervals: originals: 4; expected 5 or more"));
    EXPECT_THAT(doubts[1], HasSubstr("2 approximations"));
    EXPECT_THAT(doubts[2], HasSubstr("name of the approximation alone"));
    EXPECT_THAT(few.score().metrics[0].figures.pairs.too_few, HasSubstr("originals"));
    const Study single(6, 1, rating, [](auto o, auto) { return 9.0 - o; });
    const auto score = single.score();
    EXPECT_EQ(score.single_originals, 6U);
    EXPECT_EQ(score.metrics[0].figures.spearman.value, 1);
    EXPECT_TRUE(std::isnan(score.metrics[0].figures.pairs.value));
    EXPECT_THAT(score.doubts[1], HasSubstr("6 of 6 originals have one rated approximation"));
}

// People see a quality that both metrics know with some noise, the second with more of it.
TEST(RatingScore, MadeUpRatingsWithAKnownAnswerAreRecovered) {
    std::mt19937_64 random(3);
    std::normal_distribution<double> normal;
    std::vector<std::vector<double>> quality(60, std::vector<double>(5));
    for (auto& of_original : quality) {
        for (double& q : of_original) {
            q = normal(random);
        }
    }
    // Correlation r with the ratings: Spearman's is 6/pi asin(r/2), Kendall's 2/pi asin(r), and the
    // share of pairs 1/2 + asin(r)/pi.
    const auto noisy = [&](double r) {
        return [&, r](std::uint32_t o, std::uint32_t m) {
            return 10 - r * quality[o][m] - std::sqrt(1 - r * r) * normal(random);
        };
    };
    const Study study(
        60, 5, [&](auto o, auto m) { return quality[o][m]; }, noisy(0.9), noisy(0.5));
    const auto score = study.score();
    const double pi = std::acos(-1.0);
    for (const auto& [m, r] : {std::pair(0U, 0.9), {1U, 0.5}}) {
        const auto& figures = score.metrics[m].figures;
        for (const auto& [estimate, truth] :
             {std::pair(figures.spearman, 6 / pi * std::asin(r / 2)),
              {figures.kendall, 2 / pi * std::asin(r)},
              {figures.pairs, 0.5 + std::asin(r) / pi}}) {
            EXPECT_LT(estimate.interval.low, truth);
            EXPECT_GT(estimate.interval.high, truth);
            EXPECT_LT(estimate.interval.high - estimate.interval.low, 0.25);
        }
    }
    // The first metric is better, and both are better than a name, which says nothing here.
    ASSERT_EQ(score.differences.size(), 3U);
    EXPECT_TRUE(clear_of_zero(score.differences[0].pairs.estimate));
    EXPECT_LT(score.differences[0].spearman.p_holm, 0.001);
    EXPECT_GT(score.differences[1].pairs.estimate.interval.low, 0);
    EXPECT_THAT(score.doubts, IsEmpty());
}

/// How often intervals of so many studies have the truth in them: of spearman, kendall, pairs. A
/// metric knows the quality well with some originals (correlation 0.9) and badly with others (0.3).
std::array<double, 3> coverage(std::uint32_t originals, std::uint32_t studies) {
    constexpr std::uint32_t methods = 4;
    constexpr std::array<double, 2> known = {0.3, 0.9};
    const double pi = std::acos(-1.0);
    // Distances and ratings are normal. Two approximations are of one original, or of any two.
    std::array<double, 3> truth = {};
    double within = 0;
    double between = 0;
    for (const double r : known) {
        truth[0] += 6 / pi * std::asin(r / 2) / 2;
        within += 2 / pi * std::asin(r) / 2;
        for (const double other : known) {
            between += 2 / pi * std::asin((r + other) / 2) / 4;
        }
    }
    const double share_within = (methods - 1.0) / (originals * methods - 1.0);
    truth[1] = share_within * within + (1 - share_within) * between;
    truth[2] = (1 + within) / 2;
    std::mt19937_64 random(originals);
    std::normal_distribution<double> normal;
    std::array<double, 3> covered = {};
    for (std::uint32_t s = 0; s < studies; ++s) {
        std::vector<std::array<double, methods>> quality(originals);
        std::vector<double> r(originals);
        for (std::uint32_t o = 0; o < originals; ++o) {
            r[o] = known.at(random() % 2);
            std::ranges::generate(quality[o], [&] { return normal(random); });
        }
        const Study study(
            originals, methods, [&](auto o, auto m) { return quality[o].at(m); },
            [&](auto o, auto m) {
                return 10 - r[o] * quality[o].at(m) - std::sqrt(1 - r[o] * r[o]) * normal(random);
            });
        const auto figures = study.score().metrics[0].figures;
        const std::array estimates = {figures.spearman, figures.kendall, figures.pairs};
        for (std::size_t f = 0; f < covered.size(); ++f) {
            const auto& interval = estimates.at(f).interval;
            covered.at(f) += interval.low <= truth.at(f) && truth.at(f) <= interval.high ? 1 : 0;
        }
    }
    for (double& share : covered) {
        share /= studies;
    }
    return covered;
}

TEST(RatingScore, IntervalsHaveTheTruthInThem) {
    // docs/scoring.md has these shares of 2,000 studies each.
    for (const auto& [originals, least] : {std::pair(5U, 0.85), {20U, 0.91}}) {
        for (const double share : coverage(originals, 400)) {
            EXPECT_GT(share, least);
            EXPECT_LT(share, 0.98);
        }
    }
}

}  // namespace
}  // namespace merl::scan
