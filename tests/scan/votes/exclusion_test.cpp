#include "scan/votes/exclusion.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>

#include "scan/statistics/lots.h"
#include "simulated_votes.h"

namespace merl::scan {
namespace {

TEST(Lots, RunsAreThoseThatCanBeCounted) {
    for (std::uint64_t n = 1; n <= 12; ++n) {
        for (std::uint64_t length = 1; length <= n + 1; ++length) {
            std::uint64_t found = 0;
            for (std::uint64_t throws = 0; throws < 1U << n; ++throws) {
                std::uint64_t longest = 1;
                std::uint64_t run = 1;
                for (std::uint64_t i = 1; i < n; ++i) {
                    run = (throws >> i & 1U) == (throws >> (i - 1) & 1U) ? run + 1 : 1;
                    longest = std::max(longest, run);
                }
                found += longest >= length ? 1 : 0;
            }
            EXPECT_NEAR(run_by_lot(n, length),
                        std::ldexp(static_cast<double>(found), -static_cast<int>(n)), 1e-15)
                << n << " throws, " << length << " in a row";
        }
    }
    EXPECT_NEAR(run_by_lot(100, 100) / std::ldexp(1, -99), 1, 1e-12);
    EXPECT_EQ(run_by_lot(0, 0), 1);
    EXPECT_EQ(run_by_lot(0, 1), 0);
}

TEST(Lots, ManyAndFew) {
    EXPECT_EQ(at_least_by_lot(5, 0, 0.5), 1);
    EXPECT_EQ(at_least_by_lot(0, 1, 0.5), 0);
    EXPECT_EQ(at_most_by_lot(5, 5, 0.5), 1);
    EXPECT_NEAR(at_least_by_lot(5, 4, 1.0 / 3), 11.0 / 243, 1e-15);
    EXPECT_NEAR(at_most_by_lot(5, 1, 0.5), 6.0 / 32, 1e-15);
    EXPECT_EQ(at_least_by_lot(3, 1, 0), 0);
}

/// One judge who says 1 to a configuration and its repeat, and 3 to a sentinel, with exchanged
/// sides in one of them.
Votes three_trials() {
    Votes votes = empty_votes(2, 2, 10);
    votes.configurations[1].kind = TrialKind::sentinel;
    votes.configurations[1].expected = 1;
    votes.judges[0].ballots = {ballot(0, 1), ballot(0, 1, true, true), ballot(1, 3)};
    votes.judges[0].ballots[0].response_ms = 2000;
    return votes;
}

TEST(Exclusion, LimitsAreAsTheirNamesSay) {
    const auto votes = three_trials();
    auto statistics = vote_statistics(votes, {.replicates = 0});
    const auto excludes = [&](ExclusionRule rule, double value) {
        const auto exclusion = apply_rules(votes, statistics, {{rule, value}});
        // The other judge has no answer, of which nothing follows.
        EXPECT_FALSE(exclusion.is_excluded(1));
        EXPECT_EQ(exclusion.not_assessed.size(), 1);
        return exclusion.is_excluded(0);
    };
    EXPECT_TRUE(excludes(ExclusionRule::sentinels_failed, 1));
    EXPECT_FALSE(excludes(ExclusionRule::sentinels_failed, 2));
    EXPECT_FALSE(excludes(ExclusionRule::repeats_below, 1));
    EXPECT_TRUE(excludes(ExclusionRule::median_time_below, 2.001));
    EXPECT_FALSE(excludes(ExclusionRule::median_time_below, 2));
    EXPECT_TRUE(excludes(ExclusionRule::same_key_above, 0.6));
    EXPECT_FALSE(excludes(ExclusionRule::same_key_above, 0.7));
    // A share is not below itself, however its digits are rounded.
    statistics.judges[0].repeats = {.answered = 100, .passed = 7};
    EXPECT_FALSE(excludes(ExclusionRule::repeats_below, 0.07));
    EXPECT_TRUE(excludes(ExclusionRule::repeats_below, 0.08));
}

TEST(Exclusion, LeavesOutVotesAndNothingElse) {
    const auto votes = three_trials();
    const auto statistics = vote_statistics(votes, {.replicates = 0});
    const auto exclusion = apply_rules(votes, statistics, {{ExclusionRule::sentinels_failed, 1}});
    EXPECT_EQ(exclusion.excluded(), 1);
    EXPECT_EQ(exclusion.judges[0][0].text, "1 of 1 sentinels failed");
    const auto kept = without_excluded(votes, exclusion);
    ASSERT_EQ(kept.judges.size(), 1);
    EXPECT_EQ(kept.judges[0].name, votes.judges[1].name);
    EXPECT_EQ(kept.configurations.size(), votes.configurations.size());
}

TEST(Exclusion, WhatIsStatedTwice) {
    const StatedRule of_kit = {ExclusionRule::repeats_below, 0.5, true};
    const StatedRule other = {ExclusionRule::sentinels_failed, 2, true};
    const StatedRule mine = {ExclusionRule::repeats_below, 0.6};
    EXPECT_THAT(merge_rules({of_kit, other}, {mine}), ::testing::ElementsAre(other, mine));
    EXPECT_THAT(merge_rules({{ExclusionRule::calibration_failed, 1, true}},
                            {parse_rule("calibration_failed=false")}),
                ::testing::IsEmpty());
    EXPECT_THROW(merge_rules({}, {mine, mine}), Error);
    EXPECT_EQ(text_of(mine), "repeats_below=0.6");
}

TEST(Exclusion, RulesOfAKit) {
    const auto json = nlohmann::json::parse(
        R"({"sentinels_failed": 2, "calibration_failed": true, "median_time_below": 1.5})");
    EXPECT_THAT(
        parse_rules(json, "kit.json, exclusion"),
        ::testing::UnorderedElementsAre(StatedRule{ExclusionRule::sentinels_failed, 2, true},
                                        StatedRule{ExclusionRule::calibration_failed, 1, true},
                                        StatedRule{ExclusionRule::median_time_below, 1.5, true}));
    EXPECT_THROW(parse_rules(nlohmann::json::parse(R"({"else": 1})"), "kit.json"), InputError);
}

TEST(Doubts, OfJudgesWhoDoNotLook) {
    // Forty configurations, sides exchanged by turns: as said, on the left always, and the first
    // twenty as said and then on the left.
    Votes votes = empty_votes(3, 40, 60);
    for (std::uint32_t k = 0; k < 40; ++k) {
        const bool swapped = k % 2 == 1;
        const int left = swapped ? 3 : 1;
        votes.judges[0].ballots.push_back(ballot(k, 3, swapped));
        votes.judges[1].ballots.push_back(ballot(k, left, swapped));
        votes.judges[2].ballots.push_back(ballot(k, k < 20 ? 3 : left, swapped));
    }
    const auto s = vote_statistics(votes, {.replicates = 0});
    EXPECT_THAT(s.judges[0].doubts, ::testing::IsEmpty());
    EXPECT_THAT(s.judges[1].doubts,
                ::testing::ElementsAre("answered left 40 of 40 times: by lot p 1.8e-12"));
    EXPECT_EQ(s.judges[2].longest_run, 21);
    EXPECT_THAT(s.judges[2].doubts,
                ::testing::Contains(::testing::HasSubstr("the same side 21 times in a row")));
}

}  // namespace
}  // namespace merl::scan
