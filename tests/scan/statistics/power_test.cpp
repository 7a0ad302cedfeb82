#include "scan/statistics/power.h"

#include <gtest/gtest.h>

#include <cmath>

namespace merl::scan {
namespace {

// By hand: with five judges only 3,3,3,3,3 and one 2 among them are significant.
TEST(Power, OneConfiguration) {
    const auto power =
        power_of({.judges = 5, .configurations = 1, .right = 0.8, .equal = 0.1}, 0.05);
    const double expected = std::pow(0.8, 5) + 5 * std::pow(0.8, 4) * 0.1;
    EXPECT_NEAR(power.alone, expected, 1e-14);
    EXPECT_NEAR(power.holm_any, expected, 1e-14);
    EXPECT_NEAR(power.holm_share, expected, 1e-14);
}

TEST(Power, NoneIsPossibleWithTooFewJudges) {
    const auto power = power_of({.judges = 6, .configurations = 100, .right = 1, .equal = 0}, 0.05);
    EXPECT_DOUBLE_EQ(power.alone, 1);
    EXPECT_EQ(power.holm_any, 0);
    EXPECT_EQ(power.holm_share, 0);
    EXPECT_DOUBLE_EQ(
        power_of({.judges = 7, .configurations = 100, .right = 1, .equal = 0}, 0.05).holm_share, 1);
}

// Two configurations, three judges, level 0.1: 1/27 is below 0.05, 4/27 above 0.1. The same with
// level 0.3, where 4/27 is between 0.15 and 0.3 and needs the other configuration to be smaller:
// a = p^3 and b = 3 p^2 q are the probabilities of the two p-values.
TEST(Power, HolmStepsDown) {
    const double a = 0.512;
    const double b = 3 * 0.64 * 0.1;
    const auto plan =
        PlannedExperiment{.judges = 3, .configurations = 2, .right = 0.8, .equal = 0.1};
    const auto small = power_of(plan, 0.1);
    EXPECT_NEAR(small.holm_any, 1 - (1 - a) * (1 - a), 1e-14);
    EXPECT_NEAR(small.holm_share, a, 1e-14);
    const auto large = power_of(plan, 0.28);
    EXPECT_NEAR(large.holm_any, 1 - (1 - a) * (1 - a), 1e-14);
    EXPECT_NEAR(large.holm_share, (2 * a * a + 2 * (2 * a * b) + 2 * a * (1 - a - b)) / 2, 1e-14);
}

// Holm's procedure word by word on 3,000 to 4,000 experiments drawn by a plain Python program.
TEST(Power, IsThatOfSimulatedExperiments) {
    const auto check = [](const PlannedExperiment& plan, double share, double any) {
        const auto power = power_of(plan, 0.05);
        EXPECT_NEAR(power.holm_share, share, 0.01);
        EXPECT_NEAR(power.holm_any, any, 0.03);
    };
    check({.judges = 9, .configurations = 30, .right = 0.7, .equal = 0.2}, 0.1441, 0.9870);
    check({.judges = 12, .configurations = 20, .right = 0.75, .equal = 0.1}, 0.4512, 0.9992);
    check({.judges = 8, .configurations = 50, .right = 0.5, .equal = 0.2}, 0.0036, 0.1623);
}

}  // namespace
}  // namespace merl::scan
