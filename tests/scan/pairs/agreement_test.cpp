#include "scan/pairs/agreement.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::make_distances;

TEST(Disagree, OppositeOrders) {
    EXPECT_TRUE(disagree(1, 2, 2, 1));
    EXPECT_TRUE(disagree(2, 1, 1, 2));
    EXPECT_FALSE(disagree(1, 2, 3, 4));
    EXPECT_FALSE(disagree(2, 1, 4, 3));
}

TEST(Disagree, TieInJustOneMetric) {
    EXPECT_TRUE(disagree(1, 1, 2, 3));
    EXPECT_TRUE(disagree(1, 1, 3, 2));
    EXPECT_TRUE(disagree(2, 3, 1, 1));
    EXPECT_TRUE(disagree(3, 2, 1, 1));
    EXPECT_FALSE(disagree(1, 1, 2, 2));
    EXPECT_FALSE(disagree(0, 0, 0, 0));
}

TEST(Disagree, DifferencesBelowTheSmallestDoubleStillCount) {
    // A sign computed from a difference would do as well, as long as nothing flushes it to zero.
    EXPECT_TRUE(disagree(5e-324, 1e-323, 1, 0));
    EXPECT_TRUE(disagree(1, std::nextafter(1, 2), 1, 1));
}

TEST(Agreement, IsSmallerOverLargerProduct) {
    EXPECT_EQ(agreement(1, 4, 3, 2), 2.0 / 12.0);
    EXPECT_EQ(agreement(4, 1, 2, 3), 2.0 / 12.0);
    EXPECT_EQ(agreement(1, 1, 2, 3), 2.0 / 3.0);
    EXPECT_EQ(agreement(2, 3, 1, 1), 2.0 / 3.0);
}

TEST(Agreement, IsThePlainFormulaBitForBit) {
    std::mt19937_64 random(1);
    std::lognormal_distribution<double> value(0, 20);
    for (int i = 0; i < 100'000; ++i) {
        const double d1a = value(random);
        const double d1b = value(random);
        const double d2a = value(random);
        const double d2b = value(random);
        const double p = d1a * d2b;
        const double q = d1b * d2a;
        ASSERT_EQ(agreement(d1a, d1b, d2a, d2b), std::min(p, q) / std::max(p, q));
        ASSERT_NEAR(agreement(d1a, d1b, d2a, d2b),
                    std::exp(-std::abs(std::log(d1a / d2a) - std::log(d1b / d2b))), 1e-13);
    }
}

TEST(Agreement, OneProductZeroIsTotalDisagreement) {
    EXPECT_EQ(agreement(0, 1, 2, 1), 0);
    EXPECT_EQ(agreement(1, 2, 1, 0), 0);
    EXPECT_EQ(agreement(0, 5e-324, 5e-324, 5e-324), 0);
}

TEST(Agreement, TiedAtZeroIsDecidedByTheOtherMetric) {
    EXPECT_EQ(agreement(0, 0, 3, 4), 0.75);
    EXPECT_EQ(agreement(4, 3, 0, 0), 0.75);
    EXPECT_EQ(agreement(0, 0, 0, 4), 0);
    EXPECT_EQ(agreement(4, 0, 0, 0), 0);
    // It is the limit for two equal distances that go to zero.
    EXPECT_EQ(agreement(1e-300, 1e-300, 3, 4), 0.75);
}

TEST(Agreement, IsOneWhereNothingDisagreesAtZero) {
    EXPECT_EQ(agreement(0, 0, 0, 0), 1);
    EXPECT_EQ(agreement(0, 0, 5, 5), 1);
    EXPECT_EQ(agreement(0, 3, 0, 5), 1);
}

TEST(Agreement, DoesNotDependOnTheScaleOfAMetric) {
    // Products far beyond the range of a double: powers of two must cancel without a trace.
    std::mt19937_64 random(2);
    std::uniform_real_distribution<double> value(1, 1000);
    for (int i = 0; i < 1000; ++i) {
        const double d1a = value(random);
        const double d1b = value(random);
        const double d2a = value(random);
        const double d2b = value(random);
        const double expected = agreement(d1a, d1b, d2a, d2b);
        for (const auto& [scale_1, scale_2] : {std::pair{0x1p-900, 0x1p-900},
                                               {0x1p900, 0x1p900},
                                               {0x1p-1000, 0x1p1000},
                                               {0x1p-260, 0x1p-260},
                                               {0x1p-1022, 1.0},
                                               {0x1p1010, 1.0}}) {
            ASSERT_EQ(agreement(d1a * scale_1, d1b * scale_1, d2a * scale_2, d2b * scale_2),
                      expected);
        }
    }
}

TEST(Agreement, ExtremesStaySane) {
    EXPECT_DOUBLE_EQ(agreement(1e-200, 2e-200, 2e-200, 1e-200), 0.25);
    EXPECT_DOUBLE_EQ(agreement(1e200, 2e200, 2e200, 1e200), 0.25);
    EXPECT_DOUBLE_EQ(agreement(1e-300, 1e-200, 1e300, 1e300), 1e-100);
    EXPECT_DOUBLE_EQ(agreement(5e-324, 1e-323, 1, 1), 0.5);
    EXPECT_EQ(agreement(1e-308, 1e308, 1e308, 1e-308), 0);  // 1e-1232
    EXPECT_EQ(agreement(1.7e308, 1.7e308, 1.7e308, 1.7e308), 1);
}

TEST(Agreement, GrowsWithoutABreakFromOrdinaryToExtreme) {
    // The bound of the search needs this at the seam of the two ways to compute it as anywhere.
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> exponent(-1074, 1023);
    const auto draw = [&] { return std::exp2(exponent(random)); };
    const auto grow = [&](double x) {
        const double larger = random() % 2 == 0 ? std::nextafter(x, HUGE_VAL) : x * 1.5;
        return std::isfinite(larger) ? larger : x;
    };
    for (int i = 0; i < 200'000; ++i) {
        const auto [d1_left, d1_right] = std::minmax({draw(), draw()});
        const auto [d2_right, d2_left] = std::minmax({draw(), draw()});
        const double here = agreement(d1_left, d1_right, d2_left, d2_right);
        ASSERT_GE(here, 0);
        ASSERT_LE(here, 1);
        ASSERT_LE(agreement(d1_left, grow(d1_right), d2_left, d2_right), here);
        ASSERT_LE(agreement(d1_left, d1_right, grow(d2_left), d2_right), here);
        ASSERT_LE(agreement(0, d1_right, d2_left, d2_right), here);
        ASSERT_GE(agreement(std::min(grow(d1_left), d1_right), d1_right, d2_left, d2_right), here);
        ASSERT_GE(agreement(d1_left, d1_right, d2_left, std::min(grow(d2_right), d2_left)), here);
    }
}

TEST(Orientation, LeftHasTheSmallerFirstDistance) {
    const Distances distances = make_distances({2, 1, 5}, {1, 2, 0.5});
    EXPECT_EQ(make_configuration(distances, 0, 1), (Configuration{1, 0, 0.25}));
    EXPECT_EQ(make_configuration(distances, 1, 0), (Configuration{1, 0, 0.25}));
    EXPECT_EQ(make_configuration(distances, 0, 2), (Configuration{0, 2, 0.2}));
}

TEST(Orientation, OnATieTheOtherMetricDecides) {
    const Distances tied_first = make_distances({1, 1, 9}, {2, 4, 9});
    EXPECT_EQ(make_configuration(tied_first, 0, 1), (Configuration{1, 0, 0.5}));
    EXPECT_EQ(make_configuration(tied_first, 1, 0), (Configuration{1, 0, 0.5}));
    const Distances tied_second = make_distances({4, 2, 9}, {1, 1, 9});
    EXPECT_EQ(make_configuration(tied_second, 0, 1), (Configuration{1, 0, 0.5}));
    EXPECT_EQ(make_configuration(tied_second, 1, 0), (Configuration{1, 0, 0.5}));
}

TEST(Order, AgreementThenEarlierThenLaterPair) {
    const StrongerFirst before;
    EXPECT_TRUE(before({9, 8, 0.1}, {0, 1, 0.2}));
    EXPECT_TRUE(before({7, 1, 0.1}, {2, 3, 0.1}));  // pair 1 is earlier than pair 2
    EXPECT_TRUE(before({5, 1, 0.1}, {1, 6, 0.1}));
    EXPECT_FALSE(before({1, 6, 0.1}, {5, 1, 0.1}));
    EXPECT_FALSE(before({1, 6, 0.1}, {1, 6, 0.1}));
}

}  // namespace
}  // namespace merl::scan
