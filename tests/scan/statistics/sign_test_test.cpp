#include "scan/statistics/sign_test.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace merl::scan {
namespace {

// Expected: scipy.stats.binomtest(a, a + b) of scipy 1.10.1.
TEST(SignTest, IsThatOfScipy) {
    EXPECT_DOUBLE_EQ(sign_test(1, 9), 0.021484375);  // 22 / 1024
    EXPECT_DOUBLE_EQ(sign_test(3, 7), 0.34375);
    EXPECT_NEAR(sign_test(12, 30), 0.007915897334896727, 1e-16);
    EXPECT_DOUBLE_EQ(sign_test(0, 20), std::ldexp(2.0, -20));
    EXPECT_NEAR(sign_test(700, 800), 0.01055925546671162, 1e-14);
    EXPECT_NEAR(sign_test(4000, 5000), 5.581401567014391e-26, 1e-37);
}

TEST(SignTest, Edges) {
    EXPECT_EQ(sign_test(0, 0), 1);
    EXPECT_EQ(sign_test(0, 1), 1);
    EXPECT_EQ(sign_test(5, 5), 1);
    EXPECT_EQ(sign_test(30, 12), sign_test(12, 30));
    EXPECT_EQ(sign_test(0, 2000), 0);  // 2^-1999 is below every double
}

TEST(Holm, StepsDown) {
    const std::vector<double> p = {0.01, 0.04, 0.03, 0.005};
    const auto adjusted = holm(p);
    const std::vector<double> expected = {0.03, 0.06, 0.06, 0.02};  // Holm 1979 by hand
    ASSERT_EQ(adjusted.size(), 4);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_DOUBLE_EQ(adjusted[i], expected[i]);
    }
    EXPECT_TRUE(holm({}).empty());
    const std::vector<double> large = {0.9, 0.8};
    EXPECT_EQ(holm(large), (std::vector<double>{1, 1}));
}

}  // namespace
}  // namespace merl::scan
