#include "scan/score/score.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <string>
#include <vector>

#include "scan/pairs/pairs.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

/// Each of the materials as the reference of each pair of others, with votes out of thin air.
Judgements made_up(std::uint32_t materials) {
    JudgementFile file{"votes", "reference CSV", {}, {}};
    for (std::uint32_t m = 0; m < materials; ++m) {
        file.names.emplace_back(1, static_cast<char>('a' + m));
    }
    std::uint64_t k = 0;
    for (std::uint32_t reference = 0; reference < materials; ++reference) {
        for (std::uint32_t a = 0; a < materials; ++a) {
            for (std::uint32_t b = a + 1; b < materials; ++b) {
                if (a != reference && b != reference) {
                    file.rows.push_back(
                        {reference, a, reference, b, 3 * k % 5, k / 3 % 2, (2 * k + 1) % 4});
                    ++k;
                }
            }
        }
    }
    return resolve_judgements(file, file.names);
}

/// Without ties; with ties; with a tie and zeros.
std::vector<std::vector<double>> made_up_distances(std::uint32_t materials) {
    std::vector<std::vector<double>> distances(3);
    for (std::uint64_t p = 0; p < pair_count(materials); ++p) {
        distances[0].push_back(static_cast<double>(1 + 7 * p % 29));
        distances[1].push_back(static_cast<double>(1 + p * p % 11));
        distances[2].push_back(static_cast<double>(5 * p % 13));
    }
    return distances;
}

Score score_of(const Judgements& judgements, const std::vector<std::vector<double>>& distances) {
    std::vector<ScoredMetric> metrics;
    metrics.reserve(distances.size());
    for (const auto& column : distances) {
        metrics.push_back({"metric", column});
    }
    return score(judgements, metrics);
}

// The figures are those of a Python program (numpy 1.24.2, scipy 1.10.1) that goes through the rows
// one by one and finds the slope by brentq.
TEST(Score, IsThatOfAPlainProgram) {
    const auto s = score_of(made_up(8), made_up_distances(8));
    EXPECT_EQ(s.judgements, 168);
    EXPECT_EQ(s.untied, 134);
    EXPECT_EQ(s.votes, 754);
    EXPECT_EQ(s.equal_votes, 84);
    EXPECT_DOUBLE_EQ(s.ceiling.value, 0.6551724137931034);
    EXPECT_NEAR(s.ceiling_log_likelihood.value, -0.5998277549080847, 1e-14);
    struct Expected {
        double majorities, votes, slope, per_vote, total;
        std::uint64_t ties, zeros;
    };
    const std::vector<Expected> expected = {
        {0.5, 0.4973474801061008, -0.026357581843086612, -0.6930050306281096, -522.5257930935946, 0,
         0},
        {0.5298507462686567, 0.493368700265252, 0.003998348185165251, -0.6931451277593337,
         -522.6314263305376, 22, 0},
        {0.5149253731343284, 0.4907161803713528, 0.001139885750029562, -0.6931469307892034,
         -522.6327858150594, 3, 36}};
    for (std::size_t m = 0; m < 3; ++m) {
        EXPECT_DOUBLE_EQ(s.metrics[m].majorities.value, expected[m].majorities);
        EXPECT_DOUBLE_EQ(s.metrics[m].votes.value, expected[m].votes);
        EXPECT_NEAR(s.metrics[m].slope.value, expected[m].slope, 1e-13);
        EXPECT_NEAR(s.metrics[m].log_likelihood.value, expected[m].per_vote, 1e-14);
        EXPECT_NEAR(s.metrics[m].total_log_likelihood, expected[m].total, 1e-10);
        EXPECT_EQ(s.metrics[m].ties, expected[m].ties);
        EXPECT_EQ(s.metrics[m].zero_distances, expected[m].zeros);
        EXPECT_EQ(s.metrics[m].undecided, 0);
        EXPECT_TRUE(std::isnan(s.metrics[m].votes.interval.low));
    }
    ASSERT_EQ(s.pairs.size(), 3);
    const std::vector<std::vector<std::uint64_t>> pairs = {
        {0, 1, 29, 34}, {0, 2, 34, 36}, {1, 2, 41, 40}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(s.pairs[i].first, pairs[i][0]);
        EXPECT_EQ(s.pairs[i].second, pairs[i][1]);
        EXPECT_EQ(s.pairs[i].first_right, pairs[i][2]);
        EXPECT_EQ(s.pairs[i].second_right, pairs[i][3]);
    }
    EXPECT_DOUBLE_EQ(s.pairs[0].difference.value, 0.5 - 0.5298507462686567);
}

TEST(Score, OpposedMetricsHaveTheLikelihoodOfWhatTheySay) {
    auto s = score_of(made_up(12), made_up_distances(12));
    const auto before = s;
    limit_to_own_order(s);
    std::size_t opposed = 0;
    for (std::size_t m = 0; m < 3; ++m) {
        const auto& metric = s.metrics[m];
        EXPECT_EQ(metric.slope.value, before.metrics[m].slope.value);
        EXPECT_EQ(metric.is_chance(), metric.slope.value < 0);
        EXPECT_EQ(metric.is_opposed(), metric.slope.interval.high < 0);
        if (metric.is_chance()) {
            ++opposed;
            EXPECT_EQ(metric.log_likelihood.value, std::log(0.5));
            EXPECT_TRUE(std::isnan(metric.log_likelihood.interval.low));
            EXPECT_NE(metric.log_likelihood.too_few, "");
            EXPECT_DOUBLE_EQ(metric.total_log_likelihood,
                             static_cast<double>(s.votes) * std::log(0.5));
        } else {
            EXPECT_EQ(metric.log_likelihood.value, before.metrics[m].log_likelihood.value);
            EXPECT_EQ(metric.total_log_likelihood, before.metrics[m].total_log_likelihood);
        }
    }
    EXPECT_EQ(opposed, 2U);
}

// A Python program that gives the judgements of a material 1e-4 more and less weight, for each of
// 12 materials, computes the figures anew, also the slope, and takes the differences for
// influences; t's distribution by Simpson's rule.
TEST(Score, IntervalsAreThoseOfAPlainProgram) {
    const auto s = score_of(made_up(12), made_up_distances(12));
    EXPECT_EQ(s.clusters.materials, 12);
    EXPECT_EQ(s.clusters.references, 12);
    EXPECT_EQ(s.clusters.without_reference, 0);
    EXPECT_EQ(s.clusters.alternatives, 12);
    // By votes, which are not as many for each material; majorities have 12.
    EXPECT_DOUBLE_EQ(s.clusters.effective, 11.931558796496375);
    EXPECT_EQ(s.clusters.too_few, "");
    const auto expect = [](const Estimate& estimate, double value, double half) {
        EXPECT_NEAR(estimate.value, value, 1e-12);
        EXPECT_NEAR(estimate.interval.high - estimate.value, half, 1e-6 * half);
        EXPECT_NEAR(estimate.value - estimate.interval.low, half, 1e-6 * half);
    };
    expect(s.metrics[0].majorities, 0.5255681818181818, 0.07723701067518879);
    expect(s.metrics[1].majorities, 0.5, 0.04464910513567487);
    expect(s.metrics[2].majorities, 0.49242424242424243, 0.060482780833950874);
    expect(s.metrics[0].votes, 0.5063973063973064, 0.02204514929604);
    expect(s.metrics[2].votes, 0.49646464646464644, 0.022184392737320896);
    expect(s.metrics[0].slope, 0.005619917689825992, 0.049632920847606794);
    expect(s.metrics[1].slope, -0.025772990994014797, 0.05521178836998599);
    expect(s.metrics[2].slope, -0.013663595704278057, 0.09115088348029315);
    expect(s.metrics[0].log_likelihood, -0.6931411210505379, 0.00010643189958064126);
    expect(s.metrics[2].log_likelihood, -0.6931125863238563, 0.0004541512283183472);
    expect(s.ceiling, 0.6555555555555556, 0.02256167298231056);
    expect(s.ceiling_log_likelihood, -0.5990290841661028, 0.03141262316804833);
    expect(s.pairs[0].difference, 0.025568181818181768, 0.08393425931379123);
    expect(s.pairs[1].difference, 0.03314393939393934, 0.07726111735904496);
    expect(s.pairs[2].difference, 0.007575757575757569, 0.06353986024285306);
    EXPECT_FALSE(clear_of_zero(s.pairs[0].difference));
    // Of 0.516, 0.365 and 0.798: three times the smallest is above 1.
    EXPECT_EQ(s.pairs[1].p_holm, 1);
}

bool same(const Estimate& a, const Estimate& b) {
    return a.value == b.value && a.interval.low == b.interval.low &&
           a.interval.high == b.interval.high;
}

TEST(Score, IsTheSameForAnyNumberOfThreads) {
    const auto judgements = made_up(12);
    Score one;
    Score four;
    testing::with_threads(1, [&] { one = score_of(judgements, made_up_distances(12)); });
    testing::with_threads(4, [&] { four = score_of(judgements, made_up_distances(12)); });
    for (std::size_t m = 0; m < 3; ++m) {
        EXPECT_TRUE(same(one.metrics[m].majorities, four.metrics[m].majorities));
        EXPECT_TRUE(same(one.metrics[m].slope, four.metrics[m].slope));
        EXPECT_TRUE(same(one.metrics[m].log_likelihood, four.metrics[m].log_likelihood));
        EXPECT_TRUE(same(one.pairs[m].difference, four.pairs[m].difference));
        EXPECT_EQ(one.pairs[m].first_right, four.pairs[m].first_right);
    }
    EXPECT_TRUE(same(one.ceiling, four.ceiling));
}

/// Two pairs, a|b and a|c, with these votes; the distance of b|c does not matter.
Judgements one_judgement(std::uint64_t left, std::uint64_t equal, std::uint64_t right) {
    return resolve_judgements(
        {"votes", "reference CSV", {"a", "b", "c"}, {{0, 1, 0, 2, left, equal, right}}},
        std::vector<std::string>{"a", "b", "c"});
}

TEST(Score, AMetricWithoutAnOpinionGetsHalfOfEverything) {
    const auto s = score_of(one_judgement(5, 0, 1), {{2, 2, 1}, {0, 0, 0}});
    for (const auto& metric : s.metrics) {
        EXPECT_EQ(metric.majorities.value, 0.5);
        EXPECT_EQ(metric.votes.value, 0.5);
        EXPECT_EQ(metric.slope.value, 0);
        EXPECT_DOUBLE_EQ(metric.log_likelihood.value, std::log(0.5));
        EXPECT_EQ(metric.ties, 1);
        EXPECT_EQ(metric.zero_distances, 0);
        // Three materials say nothing about others.
        EXPECT_TRUE(std::isnan(metric.majorities.interval.low));
        EXPECT_EQ(metric.majorities.too_few, "materials: 3; expected 10 or more");
    }
    EXPECT_EQ(s.clusters.too_few, "materials: 3; expected 10 or more");
    EXPECT_TRUE(std::isnan(s.pairs[0].p_holm));
    EXPECT_TRUE(std::isnan(s.pairs[0].difference.interval.low));
}

/// The first `references` of 12 materials with each pair of the others, all votes for the pair that
/// comes first.
Judgements unanimous(std::uint32_t references) {
    auto judgements = made_up(12);
    std::erase_if(judgements.list, [&](const Judgement& judgement) {
        return materials_of(judgement, 12).list[0] >= references;
    });
    for (auto& judgement : judgements.list) {
        judgement.votes_left = 5;
        judgement.votes_equal = judgement.votes_right = 0;
    }
    return judgements;
}

TEST(Score, VotesThatAreAllAlikeAreNoCertainty) {
    std::vector<double> near(pair_count(12));
    std::iota(near.begin(), near.end(), 1);
    const std::vector<double> far(near.rbegin(), near.rend());
    const auto s = score_of(unanimous(5), {near, far});
    EXPECT_EQ(s.clusters.too_few, "");
    EXPECT_EQ(s.clusters.references, 5);
    EXPECT_EQ(s.clusters.alternatives, 12);
    EXPECT_DOUBLE_EQ(s.clusters.effective, 5);
    for (const auto& metric : s.metrics) {
        EXPECT_EQ(metric.majorities.too_few, "all judgements are alike");
        EXPECT_TRUE(std::isnan(metric.majorities.interval.low));
        EXPECT_EQ(metric.slope.too_few, "no finite value");
    }
    EXPECT_EQ(s.pairs[0].difference.value, 1);
    EXPECT_FALSE(clear_of_zero(s.pairs[0].difference));
    EXPECT_TRUE(std::isnan(s.pairs[0].p_holm));
    EXPECT_EQ(score_of(unanimous(4), {near}).clusters.too_few,
              "references and configurations without one: 4; expected 5 or more");
}

// Four references have untied majorities: the votes have intervals, the majorities none.
TEST(Score, MajoritiesHaveClustersOfTheirOwn) {
    auto judgements = made_up(12);
    for (auto& judgement : judgements.list) {
        if (materials_of(judgement, 12).list[0] > 3) {
            judgement.votes_left = judgement.votes_right;
        }
    }
    const auto s = score_of(judgements, made_up_distances(12));
    EXPECT_EQ(s.clusters.too_few, "");
    EXPECT_EQ(s.metrics[0].votes.too_few, "");
    EXPECT_EQ(s.metrics[0].majorities.too_few,
              "references and configurations without one: 4; expected 5 or more");
    EXPECT_TRUE(std::isnan(s.pairs[0].p_holm));
}

// Each configuration without a reference stands for one, and all four of its materials count.
TEST(Score, ConfigurationsWithoutAReference) {
    JudgementFile file{"votes", "configuration CSV", {}, {}};
    for (std::uint32_t m = 0; m < 12; ++m) {
        file.names.emplace_back(1, static_cast<char>('a' + m));
    }
    for (std::uint32_t m = 0; m < 6; ++m) {
        file.rows.push_back({m, m + 1, m + 3, m + 6, m % 4, 1, 2 * m % 3});
    }
    const auto s = score_of(resolve_judgements(file, file.names), made_up_distances(12));
    EXPECT_EQ(s.clusters.references, 0);
    EXPECT_EQ(s.clusters.without_reference, 6);
    EXPECT_EQ(s.clusters.materials, 12);
    EXPECT_DOUBLE_EQ(s.clusters.effective, 19.0 * 19 / (1 + 16 + 16 + 16 + 9 + 9));
    EXPECT_FALSE(std::isnan(s.metrics[0].votes.interval.low));
}

// A configuration with nearly all votes decides every figure of votes, and nothing that is left of
// them says how far off they are. Of majorities it is one of many.
TEST(Score, NoIntervalRestsOnAFewConfigurations) {
    auto judgements = made_up(12);
    judgements.list[0].votes_left = 1'000'000;
    const auto s = score_of(judgements, made_up_distances(12));
    EXPECT_EQ(s.clusters.too_few, "effective number of references: 1.01; expected 4 or more");
    for (const auto& metric : s.metrics) {
        for (const auto& figure : {metric.votes, metric.slope, metric.log_likelihood}) {
            EXPECT_EQ(figure.too_few, s.clusters.too_few);
            EXPECT_TRUE(std::isnan(figure.interval.low));
        }
        EXPECT_FALSE(std::isnan(metric.majorities.interval.low));
    }
    EXPECT_EQ(s.ceiling.too_few, s.clusters.too_few);
}

// Enough references, but for all but one of them nearly nothing.
TEST(Score, NoIntervalRestsOnOneReference) {
    auto judgements = made_up(12);
    std::vector<int> kept(12);
    std::erase_if(judgements.list, [&](const Judgement& judgement) {
        const auto reference = materials_of(judgement, 12).list[0];
        return reference > 0 && (!judgement.untied() || ++kept[reference] > 1);
    });
    const auto s = score_of(judgements, made_up_distances(12));
    EXPECT_EQ(s.clusters.references, 12);
    EXPECT_NE(s.clusters.too_few.find("effective number of references: 1."), std::string::npos);
    EXPECT_NE(s.metrics[0].majorities.too_few.find("effective number of references: 1."),
              std::string::npos);
    EXPECT_TRUE(std::isnan(s.pairs[0].p_holm));
}

TEST(Score, EqualVotesAreHalfAVoteForEachSide) {
    const auto s = score_of(one_judgement(3, 4, 1), {{1, 2, 1}});
    EXPECT_EQ(s.metrics[0].votes.value, 5.0 / 8);
    EXPECT_EQ(s.metrics[0].majorities.value, 1);
    EXPECT_EQ(s.ceiling.value, 5.0 / 8);
    EXPECT_NEAR(s.metrics[0].slope.value, std::log(5.0 / 3) / std::log(2), 1e-14);
    const auto tied = score_of(one_judgement(2, 9, 2), {{1, 2, 1}});
    EXPECT_TRUE(std::isnan(tied.metrics[0].majorities.value));  // there is no majority
    EXPECT_EQ(tied.metrics[0].votes.value, 0.5);
    EXPECT_EQ(tied.untied, 0);
}

// A distance of 0 stands for the smallest other one, here 0.25 of b|c.
TEST(Score, ZeroDistances) {
    const auto s = score_of(one_judgement(3, 0, 1), {{0, 2, 0.25}});
    EXPECT_EQ(s.metrics[0].zero_distances, 1);
    EXPECT_EQ(s.metrics[0].majorities.value, 1);
    EXPECT_NEAR(s.metrics[0].slope.value, std::log(3) / std::log(8), 1e-14);
    constexpr double tiny = std::numeric_limits<double>::denorm_min();
    constexpr double huge = std::numeric_limits<double>::max();
    const auto wide = score_of(one_judgement(3, 0, 1), {{tiny, huge, 0}});
    EXPECT_NEAR(wide.metrics[0].slope.value,
                std::log(3) / (1024 * std::log(2) + 1074 * std::log(2)), 1e-14);
}

TEST(Score, UndecidedByTheBounds) {
    const std::vector<double> distances = {1, 1.5, 9};
    const std::vector<double> wide = {0.2, 0.3, 0};
    const std::vector<double> narrow = {0.2, 0.2, 0};
    const std::vector<ScoredMetric> metrics = {{"wide", distances, wide},
                                               {"narrow", distances, narrow}};
    const auto s = score(one_judgement(3, 0, 1), metrics);
    EXPECT_EQ(s.metrics[0].undecided, 1);
    EXPECT_EQ(s.metrics[1].undecided, 0);
    const auto open = [&](const std::vector<double>& bounds) {
        return open_pairs(one_judgement(3, 0, 1), {"metric", distances, bounds});
    };
    EXPECT_EQ(open(wide), (std::vector<std::uint32_t>{0, 1}));
    EXPECT_EQ(open({0, 0.5, 7}), (std::vector<std::uint32_t>{1}));  // the other one is exact
    constexpr double none = std::numeric_limits<double>::infinity();
    EXPECT_TRUE(open(narrow).empty() && open({none, none, none}).empty() && open({}).empty());
}

TEST(Score, ProgressEndsAtOneAndMayThrow) {
    const auto distances = made_up_distances(8);
    const std::vector<ScoredMetric> metrics = {{"a", distances[0]}, {"b", distances[1]}};
    std::vector<double> shares;
    score(made_up(8), metrics, [&](double share) { shares.push_back(share); });
    EXPECT_TRUE(std::ranges::is_sorted(shares));
    EXPECT_EQ(shares.back(), 1);
    EXPECT_THROW(score(made_up(8), metrics, [](double) { throw std::runtime_error("stop"); }),
                 std::runtime_error);
}

}  // namespace
}  // namespace merl::scan
