#include "scan/votes/vote_statistics.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "scan/votes/vote_tables.h"
#include "simulated_votes.h"

namespace merl::scan {
namespace {

/// The votes of Ryman 2018.
Votes thesis() {
    Votes votes = empty_votes(5, 100, 60);
    for (std::uint32_t k = 0; k < 100; ++k) {
        const std::string pattern = k < 85   ? "33333"
                                    : k < 98 ? "33332"
                                    : k < 99 ? "33322"
                                             : "33331";
        for (std::uint32_t j = 0; j < 5; ++j) {
            votes.judges[j].ballots.push_back(ballot(k, pattern[(j + k) % 5] - '0'));
        }
    }
    return votes;
}

TEST(VoteStatistics, TheThesis) {
    const auto votes = thesis();
    const auto s = vote_statistics(votes, {.replicates = 500, .seed = 1});
    EXPECT_THAT(s.selection.sides.votes, ::testing::ElementsAre(1, 15, 484));
    EXPECT_EQ(s.significance.configurations, 100);
    EXPECT_THAT(s.significance.alone, ::testing::ElementsAre(0, 98));
    EXPECT_THAT(s.significance.holm, ::testing::ElementsAre(0, 0));
    EXPECT_THAT(s.significance.fewest_judges, ::testing::ElementsAre(7U, 10U, 11U));
    EXPECT_EQ(s.significance.most_votes, 5);
    EXPECT_NEAR(s.significance.least_p, 1.0 / 243, 1e-15);
    EXPECT_NEAR(s.significance.least_p_needed, 0.0005, 1e-15);
    EXPECT_NEAR(s.configurations[0].p_second, 0.0041, 0.00005);
    EXPECT_NEAR(s.configurations[90].p_second, 0.0247, 0.00005);
    EXPECT_NEAR(s.configurations[98].p_second, 0.0864, 0.00005);
    EXPECT_NEAR(s.configurations[99].p_second, 0.0864, 0.00005);
    EXPECT_NEAR(s.configurations[0].p_second_holm, 100.0 / 243, 1e-12);
    EXPECT_EQ(s.selection.second_right, 100);
    EXPECT_EQ(s.selection.judges_second, 5);
    EXPECT_DOUBLE_EQ(s.selection.judges_p, 0.0625);
    EXPECT_DOUBLE_EQ(s.selection.shares[2].value, 0.968);
    EXPECT_LT(s.selection.shares[2].interval.low, 0.968);
    EXPECT_EQ(s.selection.p_value, 0.0625);  // no less than the sign test of five judges can give
    EXPECT_EQ(s.selection.lead.too_few, "");
    const auto table = thesis_table(votes, s);
    for (const auto* words :
         {"33333  3.00               85  0.0041", "33332  2.80               13  0.0247",
          "33331  2.60                1  0.0864", "33322  2.60                1  0.0864",
          "option 1 (cwcbrt)  1\noption 2 (equal)  15\noption 3 (pawcielab)  484\n",
          "98 of 100 configurations favour pawcielab at 0.05"}) {
        EXPECT_THAT(table, ::testing::HasSubstr(words));
    }
}

TEST(VoteStatistics, TheOtherSideIsTheMirrorImage) {
    auto votes = thesis();
    for (auto& judge : votes.judges) {
        for (auto& b : judge.ballots) {
            b = ballot(b.configuration, 4 - b.side());
        }
    }
    const auto there = vote_statistics(thesis(), {.replicates = 200, .seed = 1});
    const auto back = vote_statistics(votes, {.replicates = 200, .seed = 1});
    EXPECT_NEAR(back.configurations[90].p_first, there.configurations[90].p_second, 1e-15);
    EXPECT_NEAR(back.configurations[90].p_second, there.configurations[90].p_first, 1e-15);
    EXPECT_DOUBLE_EQ(back.alpha.value, there.alpha.value);
    EXPECT_DOUBLE_EQ(back.selection.lead.value, -there.selection.lead.value);
    EXPECT_DOUBLE_EQ(back.selection.shares[0].interval.low, there.selection.shares[2].interval.low);
    EXPECT_EQ(back.selection.first_right, 100);
}

TEST(VoteStatistics, ChecksOfJudges) {
    Votes votes = empty_votes(2, 3, 10);
    votes.configurations[2].kind = TrialKind::sentinel;
    votes.configurations[2].expected = 1;
    votes.judges[0].ballots = {ballot(0, 3, true), ballot(0, 3, false, true), ballot(1, 1, true),
                               ballot(1, 3, false, true), ballot(2, 1, true)};
    votes.judges[1].ballots = {ballot(0, 2), ballot(0, 3, false, true), ballot(1, 0),
                               ballot(1, 3, false, true), ballot(2, 3)};
    votes.judges[0].ballots[0].response_ms = 1000;
    votes.judges[0].ballots[1].response_ms = 3000;
    votes.judges[1].ballots[0].response_ms = 5000;
    const auto s = vote_statistics(votes, {.replicates = 10, .seed = 1});
    EXPECT_EQ(s.judges[0].repeats.answered, 2);
    EXPECT_EQ(s.judges[0].repeats.passed, 1);
    EXPECT_EQ(s.judges[0].repeats.opposite, 1);
    EXPECT_EQ(s.judges[1].repeats.answered, 1);  // one first look was not answered
    EXPECT_EQ(s.judges[1].repeats.passed, 0);
    EXPECT_EQ(s.judges[1].repeats.opposite, 0);
    EXPECT_EQ(s.sentinels.answered, 2);
    EXPECT_EQ(s.sentinels.passed, 1);
    EXPECT_EQ(s.sentinels.opposite, 1);
    EXPECT_EQ(s.judges[1].trials.missing, 1);
    EXPECT_EQ(s.selection.sides.missing, 1);
    EXPECT_EQ(s.times.count, 3);
    EXPECT_EQ(s.times.quartiles[1], 3000);
    EXPECT_EQ(s.judges[0].times.quartiles[0], 1500);
    // Clopper and Pearson's interval of 1 in 2, in closed form.
    EXPECT_NEAR(s.sentinels.share().interval.low, 1 - std::sqrt(0.975), 1e-12);
    EXPECT_NEAR(s.sentinels.share().interval.high, std::sqrt(0.975), 1e-12);
}

/// Every judge votes as `side` says on the first `voted` of so many configurations.
VoteStatistics statistics_of(std::uint32_t judges, std::uint32_t configurations,
                             std::uint32_t voted, const std::function<int(std::uint32_t)>& side,
                             std::uint32_t replicates = 200) {
    Votes votes = empty_votes(judges, configurations, 30);
    for (std::uint32_t j = 0; j < judges; ++j) {
        for (std::uint32_t k = 0; k < voted; ++k) {
            votes.judges[j].ballots.push_back(ballot(k, side(7 * j + k)));
        }
    }
    return vote_statistics(votes, {.replicates = replicates, .seed = 1});
}

void expect_too_few(const VoteStatistics& s, const std::string& reason) {
    for (const auto& estimate :
         {s.selection.shares[0], s.selection.shares[1], s.selection.shares[2], s.selection.lead}) {
        EXPECT_TRUE(std::isnan(estimate.interval.low) && std::isnan(estimate.interval.high));
        EXPECT_EQ(estimate.too_few, reason);
    }
    EXPECT_TRUE(std::isnan(s.selection.p_value));
}

TEST(VoteStatistics, TooFewForCertainty) {
    const auto second = [](std::uint32_t) { return 3; };
    const auto equal = [](std::uint32_t) { return 2; };
    const auto any = [](std::uint32_t i) { return static_cast<int>(1 + i % 3); };
    const std::string alike = "no judge or material makes a difference";
    expect_too_few(statistics_of(2, 100, 1, second), "judges: 2; expected 3 or more");
    EXPECT_EQ(statistics_of(3, 100, 1, second).selection.judges_p, 0.25);
    expect_too_few(statistics_of(1, 20, 20, any), "judges: 1; expected 3 or more");
    EXPECT_LT(statistics_of(3, 20, 20, any).selection.lead.interval.low, 0);
    expect_too_few(statistics_of(9, 100, 1, second), "configurations: 1; expected 5 or more");
    expect_too_few(statistics_of(9, 1, 1, any), "configurations: 1; expected 5 or more");
    expect_too_few(statistics_of(9, 4, 4, any), "configurations: 4; expected 5 or more");
    expect_too_few(statistics_of(9, 20, 20, second), alike);
    expect_too_few(statistics_of(9, 20, 20, equal), alike);
    // The bootstrap is not theirs.
    EXPECT_EQ(statistics_of(9, 20, 20, any, 0).selection.lead.too_few, "");
    EXPECT_EQ(statistics_of(9, 20, 20, any, 38).alpha.too_few,
              "bootstrap samples: 38; expected 39 or more");
    // One material in every configuration: nothing tells what another one would make of it.
    Votes one = empty_votes(9, 20, 30);
    for (std::uint32_t k = 0; k < 20; ++k) {
        one.configurations[k].materials[0] = "everywhere";
        for (std::uint32_t j = 0; j < 9; ++j) {
            one.judges[j].ballots.push_back(ballot(k, any(j + k)));
        }
    }
    expect_too_few(vote_statistics(one, {.replicates = 100}),
                   "one judge or material has all votes");
    // Judges, and configurations, without a vote do not count.
    Votes silent = empty_votes(9, 20, 30);
    for (std::uint32_t j = 0; j < 2; ++j) {
        for (std::uint32_t k = 0; k < 20; ++k) {
            silent.judges[j].ballots.push_back(ballot(k, any(j + k)));
        }
    }
    expect_too_few(vote_statistics(silent, {.replicates = 100}), "judges: 2; expected 3 or more");
    // Enough: but of a metric that nobody voted for there is still no interval.
    const auto enough =
        statistics_of(5, 20, 20, [](std::uint32_t i) { return i % 3 == 0 ? 2 : 3; });
    EXPECT_EQ(enough.selection.shares[0].too_few, alike);
    EXPECT_LT(enough.selection.shares[2].interval.low, enough.selection.shares[2].interval.high);
    EXPECT_GE(enough.selection.p_value, 0.0625);
    EXPECT_EQ(statistics_of(8, 20, 20, [](std::uint32_t i) { return i % 3 == 0 ? 2 : 3; })
                  .selection.p_value,
              0.0078125);
}

TEST(VoteStatistics, HolmCountsEveryConfigurationOfTheSelection) {
    // Three judges, who agree, on one of a hundred: the least p of 1/27 is that of one test in 100.
    const auto s = statistics_of(3, 100, 1, [](std::uint32_t) { return 3; });
    EXPECT_NEAR(s.configurations[0].p_second, 1.0 / 27, 1e-15);
    EXPECT_EQ(s.configurations[0].p_second_holm, 1);
    EXPECT_TRUE(std::isnan(s.configurations[1].p_second_holm));
    // Nine judges: 3^-9 times 100, and of one test alone 3^-9.
    const auto nine = statistics_of(9, 100, 2, [](std::uint32_t) { return 3; });
    EXPECT_NEAR(nine.configurations[1].p_second_holm, 100 / std::pow(3.0, 9), 1e-15);
    const auto one = statistics_of(9, 1, 1, [](std::uint32_t) { return 3; });
    EXPECT_NEAR(one.configurations[0].p_second_holm, std::pow(3.0, -9), 1e-15);
}

TEST(VoteStatistics, SignificanceIsOfTheSelection) {
    // Nine judges agree on two of a hundred for the second metric, and on the last for the first.
    Votes votes = empty_votes(9, 100, 30);
    votes.configurations[98].kind = TrialKind::random;
    for (auto& judge : votes.judges) {
        judge.ballots = {ballot(0, 3), ballot(1, 3), ballot(98, 3), ballot(99, 1)};
    }
    votes.judges[0].ballots[0] = ballot(0, 2);  // 10 / 3^9: more than 0.05 / 99, less than / 98
    votes.judges[0].ballots[3] = ballot(99, 0);
    const auto s = vote_statistics(votes, {.replicates = 0}).significance;
    EXPECT_EQ(s.configurations, 99);
    EXPECT_EQ(s.judged, 3);
    EXPECT_THAT(s.alone, ::testing::ElementsAre(1, 2));
    EXPECT_THAT(s.holm, ::testing::ElementsAre(1, 2));
    EXPECT_EQ(s.most_votes, 9);
    EXPECT_NEAR(s.least_p, std::pow(3.0, -9), 1e-15);
    EXPECT_NEAR(s.least_p_needed, 0.05 / 99, 1e-15);
    // Three who agree cannot be significant among a hundred.
    const auto three = statistics_of(3, 100, 1, [](std::uint32_t) { return 3; }).significance;
    EXPECT_THAT(three.alone, ::testing::ElementsAre(0, 1));
    EXPECT_THAT(three.holm, ::testing::ElementsAre(0, 0));
    EXPECT_GT(three.least_p, three.least_p_needed);
    // Nothing was selected: nothing can be significant.
    for (auto& configuration : votes.configurations) {
        configuration.kind = TrialKind::random;
    }
    const auto none = vote_statistics(votes, {.replicates = 0}).significance;
    EXPECT_EQ(none.configurations, 0);
    EXPECT_EQ(none.most_votes, 0);
    EXPECT_FALSE(none.fewest_judges[0]);
}

TEST(VoteStatistics, ProgressMayEndTheBootstrap) {
    double last = -1;
    const auto votes = thesis();
    (void)vote_statistics(votes, {.replicates = 200}, [&](double share) {
        EXPECT_GE(share, last);
        EXPECT_LE(share, 1);
        last = share;
    });
    EXPECT_GT(last, 0);
    EXPECT_THROW(vote_statistics(votes, {.replicates = 200},
                                 [](double) { throw std::runtime_error("enough"); }),
                 std::runtime_error);
}

TEST(VoteStatistics, NobodyVoted) {
    Votes votes = empty_votes(1, 2, 10);
    votes.judges[0].ballots = {ballot(0, 0), ballot(1, 0)};
    const auto s = vote_statistics(votes, {.replicates = 10, .seed = 1});
    EXPECT_TRUE(std::isnan(s.configurations[0].p_second));
    EXPECT_TRUE(std::isnan(s.configurations[0].sides.mean()));
    EXPECT_TRUE(std::isnan(s.selection.p_value));
    EXPECT_TRUE(std::isnan(s.selection.shares[0].value));
    EXPECT_TRUE(std::isnan(s.alpha.value));
    EXPECT_TRUE(std::isnan(s.repeats.share().value));
    EXPECT_EQ(s.selection.sides.missing, 2);
}

/// How many of so many experiments have an interval of the lead that holds the truth.
int covered(const SimulatedJudges& simulation, std::uint32_t experiments) {
    int held = 0;
    for (std::uint32_t seed = 1; seed <= experiments; ++seed) {
        const auto s = vote_statistics(simulation.run(seed), {.replicates = 0}).selection;
        const auto [low, high] = s.lead.interval;
        held += low <= simulation.lead() && simulation.lead() <= high ? 1 : 0;
    }
    return held;
}

TEST(VoteStatistics, IntervalsOfFewJudgesCover) {
    constexpr std::uint32_t experiments = 300;
    // Percentiles of a bootstrap cover 0.90 and 0.76 of the first two with five judges.
    for (const std::uint32_t judges : {3U, 5U, 8U}) {
        for (const auto& simulation :
             {SimulatedJudges{.judges = judges, .judge_effect = 1},
              SimulatedJudges{.judges = judges, .judge_effect = 1, .mean = 2},
              SimulatedJudges{.judges = judges, .judge_effect = 0.5, .material_effect = 0.7}}) {
            EXPECT_GE(covered(simulation, experiments), 0.93 * experiments);
        }
    }
    // Ten materials: each is in two fifths of the votes.
    EXPECT_GE(covered({.configurations = 30, .materials = 10, .material_effect = 2}, experiments),
              0.93 * experiments);
}

TEST(VoteStatistics, OriginalsAreTheClustersOfAReferenceKit) {
    constexpr std::uint32_t experiments = 300;
    for (const double mean : {0.0, 2.0}) {
        const SimulatedJudges simulation{.judges = 8,
                                         .materials = 20,
                                         .judge_effect = 0.5,
                                         .material_effect = 0.7,
                                         .mean = mean,
                                         .reference = true};
        EXPECT_GE(covered(simulation, experiments), 0.93 * experiments);
    }
    // Nothing but originals: as many as there are, and none has anything to say about the others.
    Votes votes = empty_reference_votes(9, 8, 4);
    for (auto& judge : votes.judges) {
        for (std::uint32_t k = 0; k < 8; ++k) {
            judge.ballots.push_back(ballot(k, k % 2 == 0 ? 1 : 3));
        }
    }
    expect_too_few(vote_statistics(votes, {.replicates = 0}), "originals: 4; expected 5 or more");
}

TEST(VoteStatistics, ApproximationsAreCountedByLabel) {
    Votes votes = empty_reference_votes(2, 4, 4);
    const auto set = [&](std::uint32_t k, const char* left, const char* right) {
        const auto name = std::to_string(k);
        votes.configurations[k].materials = {"o/" + name, left + name, "o/" + name, right + name};
    };
    set(0, "a/", "b/");
    set(1, "b/", "a/");
    set(2, "c/", "a/");
    set(3, "c/", "b/");
    votes.configurations[3].kind = TrialKind::random;
    votes.judges[0].ballots = {ballot(0, 1, true), ballot(1, 3), ballot(2, 2), ballot(3, 1),
                               ballot(0, 3, false, true)};  // the repeat does not count
    votes.judges[1].ballots = {ballot(0, 3), ballot(1, 0), ballot(2, 3, true), ballot(3, 1)};
    const auto s = vote_statistics(votes, {.replicates = 0});
    const auto text = [](const std::vector<ApproximationVotes>& rows) {
        std::string all;
        for (const auto& row : rows) {
            all +=
                fmt::format("{}-{} {} {}:{}:{} {:.3f}\n", row.label, row.other, row.configurations,
                            row.votes[0], row.votes[1], row.votes[2], row.share.value);
        }
        return all;
    };
    EXPECT_EQ(text(s.selection.approximations),
              "a- 3 3:1:1 0.700\n"
              "b- 2 1:0:2 0.333\n"
              "c- 1 0:1:1 0.250\n"
              "a-b 2 2:0:1 0.667\n"
              "a-c 1 1:1:0 0.750\n");
    EXPECT_EQ(text(s.random->approximations),
              "b- 1 0:0:2 0.000\n"
              "c- 1 2:0:0 1.000\n"
              "b-c 1 0:0:2 0.000\n");
    EXPECT_EQ(s.selection.approximations[0].share.too_few, "judges: 2; expected 3 or more");
    // Whether a label is left or right of a configuration does not matter, nor does any other.
    const SimulatedJudges simulation{.judges = 5, .configurations = 120, .reference = true};
    auto simulated = simulation.run(3);
    const auto before = vote_statistics(simulated, {.replicates = 0}).selection.approximations;
    for (std::uint32_t k = 0; k < 120; k += 2) {
        auto& m = simulated.configurations[k].materials;
        std::swap(m[1], m[3]);
        for (auto& judge : simulated.judges) {
            judge.ballots[k] = ballot(k, 4 - judge.ballots[k].side());
        }
    }
    const auto after = vote_statistics(simulated, {.replicates = 0}).selection.approximations;
    ASSERT_EQ(text(after), text(before));
    ASSERT_EQ(before.size(), 4U + 6);
    for (std::size_t i = 0; i < before.size(); ++i) {
        EXPECT_DOUBLE_EQ(after[i].share.interval.low, before[i].share.interval.low);
        EXPECT_LT(before[i].share.interval.low, before[i].share.value);
    }
    EXPECT_TRUE(vote_statistics(thesis(), {.replicates = 0}).selection.approximations.empty());
}

TEST(VoteStatistics, TheOverallPIsThatOfTheInterval) {
    // Where people have no preference every twentieth p is below 0.05, or fewer.
    SimulatedJudges simulation{.judge_effect = 1, .mean = 0};
    int small = 0;
    for (std::uint32_t seed = 1; seed <= 300; ++seed) {
        const auto s = vote_statistics(simulation.run(seed), {.replicates = 0}).selection;
        const auto [low, high] = s.lead.interval;
        EXPECT_EQ(s.p_value<0.05, low> 0 || high < 0) << seed;
        small += s.p_value < 0.05 ? 1 : 0;
    }
    EXPECT_LE(small, 300 * 0.07);
    EXPECT_GE(small, 1);
}

TEST(VoteStatistics, SimulatedJudgesAreRecovered) {
    constexpr std::uint32_t experiments = 100;
    for (const auto& simulation :
         {SimulatedJudges{.leaning = 0.3}, SimulatedJudges{.judge_effect = 0.5},
          SimulatedJudges{.judge_effect = 0.5, .material_effect = 0.7, .leaning = 0.3}}) {
        int leaning = 0;
        for (std::uint32_t seed = 1; seed <= experiments; ++seed) {
            const auto s = vote_statistics(simulation.run(seed), {.replicates = 0});
            leaning += s.bias.p_value <= 0.01 ? 1 : 0;
        }
        EXPECT_GE(covered(simulation, experiments), 93);
        if (simulation.leaning > 0) {
            EXPECT_GE(leaning, 95);
        } else {
            EXPECT_LE(leaning, 5);
        }
    }
}

}  // namespace
}  // namespace merl::scan
