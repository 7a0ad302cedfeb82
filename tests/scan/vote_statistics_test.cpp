#include "scan/vote_statistics.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "scan/vote_tables.h"

namespace merl::scan {
namespace {

/// `configurations` of four materials each out of `materials`, and judges who have not voted.
Votes empty_votes(std::uint32_t judges, std::uint32_t configurations, std::uint32_t materials) {
    Votes votes{.first_metric = "cwcbrt",
                .second_metric = "pawcielab",
                .kit_hash = "k",
                .with_kit = true,
                .configurations = {},
                .judges = {},
                .trials = configurations};
    std::mt19937 random(1);
    for (std::uint32_t k = 0; k < configurations; ++k) {
        std::vector<std::uint32_t> four;
        while (four.size() < 4) {
            const auto material = static_cast<std::uint32_t>(random() % materials);
            if (std::ranges::find(four, material) == four.end()) {
                four.push_back(material);
            }
        }
        const auto name = [&](std::size_t i) { return fmt::format("m{}", four[i]); };
        votes.configurations.push_back({.number = k + 1,
                                        .kind = TrialKind::selection,
                                        .materials = {name(0), name(1), name(2), name(3)},
                                        .agreement = 0.5,
                                        .expected = 0});
    }
    for (std::uint32_t j = 0; j < judges; ++j) {
        votes.judges.push_back({.name = fmt::format("judge {}", j), .file = "f", .ballots = {}});
    }
    return votes;
}

Ballot ballot(std::uint32_t configuration, int side, bool swapped = false, bool repeat = false) {
    return {.configuration = configuration,
            .repeat = repeat,
            .swapped = swapped,
            .shown = static_cast<std::uint8_t>(swapped && side != 0 ? 4 - side : side),
            .response_ms = std::nullopt};
}

/// SPEC 6: the votes of the thesis.
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
    std::uint64_t significant = 0;
    std::uint64_t after_holm = 0;
    for (const auto& row : s.configurations) {
        significant += row.p_second <= significance ? 1 : 0;
        after_holm += row.p_second_holm <= significance ? 1 : 0;
    }
    EXPECT_EQ(significant, 98);
    EXPECT_EQ(after_holm, 0);
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
    EXPECT_LT(s.selection.p_value, 0.01);
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

/// Judges who answer by what they see, a + b, with effects of judge, materials and chance, and who
/// lean to the left of the screen.
struct Simulation {
    double judge_effect;
    double material_effect;
    double leaning;

    Votes run(std::uint32_t seed) const {
        Votes votes = empty_votes(12, 60, 40);
        std::mt19937 random(seed);
        std::normal_distribution<double> normal;
        std::vector<double> materials(40);
        for (auto& material : materials) {
            material = material_effect / 2 * normal(random);
        }
        for (auto& judge : votes.judges) {
            const double effect = judge_effect * normal(random);
            for (std::uint32_t k = 0; k < votes.configurations.size(); ++k) {
                const bool swapped = random() % 2 == 1;
                double x = 0.5 + effect + normal(random) + (swapped ? leaning : -leaning);
                for (const auto& name : votes.configurations[k].materials) {
                    x += materials.at(std::stoul(name.substr(1)));
                }
                judge.ballots.push_back(ballot(k, x > 0.3 ? 3 : x < -0.3 ? 1 : 2, swapped));
            }
        }
        return votes;
    }

    /// The expected lead of the second metric over all judges and materials.
    double lead() const {
        const double sigma =
            std::sqrt(1 + judge_effect * judge_effect + material_effect * material_effect);
        const auto above = [&](double mean, double limit) {
            return 0.5 * std::erfc((limit - mean) / sigma / std::sqrt(2.0));
        };
        double sum = 0;
        for (const double mean : {0.5 + leaning, 0.5 - leaning}) {
            sum += (above(mean, 0.3) - (1 - above(mean, -0.3))) / 2;
        }
        return sum;
    }
};

TEST(VoteStatistics, SimulatedJudgesAreRecovered) {
    constexpr std::uint32_t experiments = 100;
    for (const auto& simulation :
         {Simulation{0, 0, 0.3}, Simulation{0.5, 0, 0}, Simulation{0.5, 0.7, 0.3}}) {
        int covered = 0;
        int leaning = 0;
        for (std::uint32_t seed = 1; seed <= experiments; ++seed) {
            const auto s = vote_statistics(simulation.run(seed), {.replicates = 200, .seed = seed});
            const auto& interval = s.selection.lead.interval;
            covered +=
                interval.low <= simulation.lead() && simulation.lead() <= interval.high ? 1 : 0;
            leaning += s.bias.p_value <= 0.01 ? 1 : 0;
        }
        EXPECT_GE(covered, 88);
        if (simulation.leaning > 0) {
            EXPECT_GE(leaning, 95);
        } else {
            EXPECT_LE(leaning, 5);
        }
    }
}

}  // namespace
}  // namespace merl::scan
