#include "scan/statistics/uniform_test.h"

#include <gtest/gtest.h>

#include <cmath>

namespace merl::scan {
namespace {

// The votes of Ryman 2018.
TEST(UniformVotes, FiveVotesOfTheThesis) {
    const UniformVotes test(5);
    EXPECT_DOUBLE_EQ(test.at_least(15), 1.0 / 243);
    EXPECT_DOUBLE_EQ(test.at_least(14), 6.0 / 243);
    EXPECT_DOUBLE_EQ(test.at_least(13), 21.0 / 243);
    EXPECT_DOUBLE_EQ(test.at_most(5), 1.0 / 243);
    EXPECT_EQ(test.at_least(5), 1);
    EXPECT_EQ(test.at_most(15), 1);
    EXPECT_NEAR(test.at_least(10) + test.at_most(10), 1 + 51.0 / 243, 1e-15);
}

// Trinomial coefficients by Python's integers: ways of n votes with a sum of s or more, over 3^n.
TEST(UniformVotes, ManyVotes) {
    EXPECT_DOUBLE_EQ(UniformVotes(1).at_least(3), 1.0 / 3);
    EXPECT_NEAR(UniformVotes(20).at_least(48) / 0.01927918026153863, 1, 1e-13);
    EXPECT_NEAR(UniformVotes(100).at_least(230) / 0.00013693971774444988, 1, 1e-13);
    EXPECT_NEAR(UniformVotes(400).at_least(1200) / std::pow(3.0, -400), 1, 1e-13);
}

// All the same: 1 of 3^n is 0.0005 or less. Up to one vote "equal": 1 + n of 3^n; two: 1 + n +
// n(n+1)/2.
TEST(FewestJudges, UntilSignificanceIsPossible) {
    EXPECT_EQ(fewest_judges(0.05, 1, 0), 3);
    EXPECT_EQ(fewest_judges(0.05, 100, 0), 7);
    EXPECT_EQ(fewest_judges(0.05, 100, 1), 10);
    EXPECT_EQ(fewest_judges(0.05, 100, 2), 11);
}

}  // namespace
}  // namespace merl::scan
