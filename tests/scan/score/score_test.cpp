#include "scan/score/score.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "scan/pairs/pairs.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

constexpr std::uint32_t kMaterials = 8;

/// Each of 8 materials as the reference of each pair of others, with votes out of thin air.
Judgements made_up() {
    JudgementFile file{"votes", "reference CSV", {}, {}};
    for (std::uint32_t m = 0; m < kMaterials; ++m) {
        file.names.push_back(std::string(1, static_cast<char>('a' + m)));
    }
    std::uint64_t k = 0;
    for (std::uint32_t reference = 0; reference < kMaterials; ++reference) {
        for (std::uint32_t a = 0; a < kMaterials; ++a) {
            for (std::uint32_t b = a + 1; b < kMaterials; ++b) {
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
std::vector<std::vector<double>> made_up_distances() {
    std::vector<std::vector<double>> distances(3);
    for (std::uint64_t p = 0; p < pair_count(kMaterials); ++p) {
        distances[0].push_back(static_cast<double>(1 + 7 * p % 29));
        distances[1].push_back(static_cast<double>(1 + p * p % 11));
        distances[2].push_back(static_cast<double>(5 * p % 13));
    }
    return distances;
}

Score score_of(const Judgements& judgements, const std::vector<std::vector<double>>& distances,
               const BootstrapOptions& options) {
    std::vector<ScoredMetric> metrics;
    for (const auto& column : distances) {
        metrics.push_back({"metric", column});
    }
    return score(judgements, metrics, options);
}

// The figures are those of a Python program (numpy 1.24.2, scipy 1.10.1) that goes through the rows
// one by one and finds the slope by brentq, and p-values by binomtest.
TEST(Score, IsThatOfAPlainProgram) {
    const auto s = score_of(made_up(), made_up_distances(), {.replicates = 0});
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
    const std::vector<std::vector<double>> pairs = {
        {0, 1, 29, 34, 0.6146550157654618}, {0, 2, 34, 36, 0.9049745264594622}, {1, 2, 41, 40, 1}};
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(s.pairs[i].first, pairs[i][0]);
        EXPECT_EQ(s.pairs[i].second, pairs[i][1]);
        EXPECT_EQ(static_cast<double>(s.pairs[i].first_right), pairs[i][2]);
        EXPECT_EQ(static_cast<double>(s.pairs[i].second_right), pairs[i][3]);
        EXPECT_NEAR(s.pairs[i].p_value, pairs[i][4], 1e-14);
        EXPECT_EQ(s.pairs[i].p_holm, 1);
    }
    EXPECT_DOUBLE_EQ(s.pairs[0].difference.value, 0.5 - 0.5298507462686567);
}

TEST(Score, OpposedMetricsHaveTheLikelihoodOfWhatTheySay) {
    auto s = score_of(made_up(), made_up_distances(), {.replicates = 100});
    const auto before = s;
    limit_to_own_order(s);
    EXPECT_TRUE(s.metrics[0].opposed());
    EXPECT_EQ(s.metrics[0].log_likelihood.value, std::log(0.5));
    EXPECT_TRUE(std::isnan(s.metrics[0].log_likelihood.interval.low));
    EXPECT_NE(s.metrics[0].log_likelihood.too_few, "");
    EXPECT_DOUBLE_EQ(s.metrics[0].total_log_likelihood, 754 * std::log(0.5));
    EXPECT_EQ(s.metrics[0].slope.value, before.metrics[0].slope.value);
    for (std::size_t m = 1; m < 3; ++m) {
        EXPECT_FALSE(s.metrics[m].opposed());
        EXPECT_EQ(s.metrics[m].log_likelihood.value, before.metrics[m].log_likelihood.value);
        EXPECT_EQ(s.metrics[m].total_log_likelihood, before.metrics[m].total_log_likelihood);
    }
}

// The same program's bootstrap over the reference materials, 20,000 samples of numpy's generator;
// the tolerances are the Monte Carlo error of both.
TEST(Score, IntervalsAreThoseOfAPlainBootstrap) {
    const auto s = score_of(made_up(), made_up_distances(), {.replicates = 20'000, .seed = 5});
    const auto expect = [](const Estimate& estimate, double low, double high, double tolerance) {
        EXPECT_NEAR(estimate.interval.low, low, tolerance);
        EXPECT_NEAR(estimate.interval.high, high, tolerance);
    };
    expect(s.metrics[0].majorities, 0.44117647, 0.55223881, 0.005);
    expect(s.metrics[1].majorities, 0.47761194, 0.58208955, 0.005);
    expect(s.metrics[2].majorities, 0.43233083, 0.60526316, 0.005);
    expect(s.metrics[0].votes, 0.47805851, 0.5167336, 0.002);
    expect(s.metrics[1].votes, 0.47657296, 0.51044386, 0.002);
    expect(s.metrics[2].votes, 0.4599466, 0.51930759, 0.002);
    expect(s.metrics[0].slope, -0.08214255, 0.05099014, 0.005);
    expect(s.metrics[1].slope, -0.08169559, 0.06396017, 0.005);
    expect(s.metrics[2].slope, -0.08200351, 0.09176093, 0.005);
    expect(s.metrics[0].log_likelihood, -0.69314656, -0.69170808, 1e-4);
    expect(s.pairs[0].difference, -0.08712121, 0.04074074, 0.005);
}

bool same(const Estimate& a, const Estimate& b) {
    return a.value == b.value && a.interval.low == b.interval.low &&
           a.interval.high == b.interval.high;
}

TEST(Score, IsTheSameForAnyNumberOfThreads) {
    const auto judgements = made_up();
    const BootstrapOptions options = {.replicates = 200, .seed = 9};
    Score one;
    Score four;
    testing::with_threads(1, [&] { one = score_of(judgements, made_up_distances(), options); });
    testing::with_threads(4, [&] { four = score_of(judgements, made_up_distances(), options); });
    for (std::size_t m = 0; m < 3; ++m) {
        EXPECT_TRUE(same(one.metrics[m].majorities, four.metrics[m].majorities));
        EXPECT_TRUE(same(one.metrics[m].slope, four.metrics[m].slope));
        EXPECT_TRUE(same(one.metrics[m].log_likelihood, four.metrics[m].log_likelihood));
        EXPECT_TRUE(same(one.pairs[m].difference, four.pairs[m].difference));
    }
    EXPECT_TRUE(same(one.ceiling, four.ceiling));
    const auto other = score_of(judgements, made_up_distances(), {.replicates = 200, .seed = 10});
    EXPECT_FALSE(same(one.metrics[0].slope, other.metrics[0].slope));
}

/// Two pairs, a|b and a|c, with these votes; the distance of b|c does not matter.
Judgements one_judgement(std::uint64_t left, std::uint64_t equal, std::uint64_t right) {
    return resolve_judgements(
        {"votes", "reference CSV", {"a", "b", "c"}, {{0, 1, 0, 2, left, equal, right}}},
        std::vector<std::string>{"a", "b", "c"});
}

TEST(Score, AMetricWithoutAnOpinionGetsHalfOfEverything) {
    const auto s = score_of(one_judgement(5, 0, 1), {{2, 2, 1}, {0, 0, 0}}, {.replicates = 10});
    for (const auto& metric : s.metrics) {
        EXPECT_EQ(metric.majorities.value, 0.5);
        EXPECT_EQ(metric.votes.value, 0.5);
        EXPECT_EQ(metric.slope.value, 0);
        EXPECT_DOUBLE_EQ(metric.log_likelihood.value, std::log(0.5));
        EXPECT_EQ(metric.ties, 1);
        EXPECT_EQ(metric.zero_distances, 0);
        // One cluster says nothing about others.
        EXPECT_TRUE(std::isnan(metric.majorities.interval.low));
        EXPECT_EQ(metric.majorities.too_few, "clusters: 1; expected 5 or more");
    }
    EXPECT_EQ(s.too_few, "clusters: 1; expected 5 or more");
    EXPECT_TRUE(std::isnan(s.pairs[0].p_value) && std::isnan(s.pairs[0].p_holm));
    EXPECT_TRUE(std::isnan(s.pairs[0].difference.interval.low));
}

/// So many references, each judged once, with all votes for the nearer one.
Judgements unanimous(std::uint32_t references) {
    JudgementFile file = {"votes", "reference CSV", {}, {}};
    for (std::uint32_t i = 0; i < references + 2; ++i) {
        file.names.push_back(fmt::format("m{:02}", i));
    }
    for (std::uint32_t i = 0; i < references; ++i) {
        file.rows.push_back({i, references, i, references + 1, 5, 0, 0});
    }
    return resolve_judgements(file, file.names);
}

TEST(Score, VotesThatAreAllAlikeAreNoCertainty) {
    const auto judgements = unanimous(9);
    std::vector<double> near(55);
    std::vector<double> far(55);
    for (std::size_t i = 0; i < near.size(); ++i) {
        near[i] = static_cast<double>(i + 1);
        far[i] = static_cast<double>(100 - i);
    }
    const auto s = score_of(judgements, {near, far}, {.replicates = 100});
    EXPECT_EQ(s.too_few, "");
    for (const auto& metric : s.metrics) {
        EXPECT_EQ(metric.majorities.too_few, "all bootstrap samples are alike");
        EXPECT_TRUE(std::isnan(metric.majorities.interval.low));
        EXPECT_TRUE(std::isnan(metric.slope.interval.low));  // infinite in all samples
    }
    EXPECT_FALSE(std::isnan(s.pairs[0].p_value));
    EXPECT_EQ(
        score_of(unanimous(4), {std::vector<double>(near.begin(), near.begin() + 15)}, {}).too_few,
        "clusters: 4; expected 5 or more");
}

TEST(Score, EqualVotesAreHalfAVoteForEachSide) {
    const auto s = score_of(one_judgement(3, 4, 1), {{1, 2, 1}}, {.replicates = 0});
    EXPECT_EQ(s.metrics[0].votes.value, 5.0 / 8);
    EXPECT_EQ(s.metrics[0].majorities.value, 1);
    EXPECT_EQ(s.ceiling.value, 5.0 / 8);
    EXPECT_NEAR(s.metrics[0].slope.value, std::log(5.0 / 3) / std::log(2), 1e-14);
    const auto tied = score_of(one_judgement(2, 9, 2), {{1, 2, 1}}, {.replicates = 10});
    EXPECT_TRUE(std::isnan(tied.metrics[0].majorities.value));  // there is no majority
    EXPECT_EQ(tied.metrics[0].votes.value, 0.5);
    EXPECT_EQ(tied.untied, 0);
}

// A distance of 0 stands for the smallest other one, here 0.25 of b|c.
TEST(Score, ZeroDistances) {
    const auto s = score_of(one_judgement(3, 0, 1), {{0, 2, 0.25}}, {.replicates = 0});
    EXPECT_EQ(s.metrics[0].zero_distances, 1);
    EXPECT_EQ(s.metrics[0].majorities.value, 1);
    EXPECT_NEAR(s.metrics[0].slope.value, std::log(3) / std::log(8), 1e-14);
    constexpr double tiny = std::numeric_limits<double>::denorm_min();
    constexpr double huge = std::numeric_limits<double>::max();
    const auto wide = score_of(one_judgement(3, 0, 1), {{tiny, huge, 0}}, {.replicates = 0});
    EXPECT_NEAR(wide.metrics[0].slope.value,
                std::log(3) / (1024 * std::log(2) + 1074 * std::log(2)), 1e-14);
}

TEST(Score, UndecidedByTheBounds) {
    const std::vector<double> distances = {1, 1.5, 9};
    const std::vector<double> wide = {0.2, 0.3, 0};
    const std::vector<double> narrow = {0.2, 0.2, 0};
    const std::vector<ScoredMetric> metrics = {{"wide", distances, wide},
                                               {"narrow", distances, narrow}};
    const auto s = score(one_judgement(3, 0, 1), metrics, {.replicates = 0});
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
    const auto distances = made_up_distances();
    const std::vector<ScoredMetric> metrics = {{"a", distances[0]}, {"b", distances[1]}};
    std::vector<double> shares;
    score(made_up(), metrics, {.replicates = 100}, [&](double share) { shares.push_back(share); });
    EXPECT_TRUE(std::ranges::is_sorted(shares));
    EXPECT_EQ(shares.back(), 1);
    EXPECT_THROW(score(made_up(), metrics, {.replicates = 100},
                       [](double) { throw std::runtime_error("stop"); }),
                 std::runtime_error);
}

}  // namespace
}  // namespace merl::scan
