#include "scan/statistics/crossed_share.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace merl::scan {
namespace {

/// Two judges on three configurations of materials of their own: 1 0 1, 1 1 0.5.
const std::vector<CrossedValue> values = {{0, 0, 1}, {0, 1, 0}, {0, 2, 1},
                                          {1, 0, 1}, {1, 1, 1}, {1, 2, 0.5}};
const std::vector<std::vector<std::uint32_t>> materials = {{0}, {1}, {2}};

double odds(double sum, double count) {
    return std::log((sum + 0.5) / (count - sum + 0.5));
}

TEST(CrossedShare, IsTheJackknifeByHand) {
    const CrossedShare share(values, 2, materials, 3);
    const auto estimate = share.estimate();
    EXPECT_DOUBLE_EQ(estimate.value, 0.75);
    const double all = odds(4.5, 6);
    const auto square = [&](double sum, double count) {
        return std::pow(odds(sum, count) - all, 2);
    };
    const double judges = (square(2.5, 3) + square(2, 3)) / 2;
    const double of_materials = (square(2.5, 4) + square(3.5, 4) + square(3, 4)) * 2 / 3;
    // Quantiles 0.975 of Student's t with one and two degrees of freedom.
    const double half =
        std::sqrt(std::pow(12.706204736, 2) * judges + std::pow(4.302652730, 2) * of_materials);
    const double odds_of_mean = std::log(3.0);
    EXPECT_NEAR(estimate.interval.low, 1 / (1 + std::exp(half - odds_of_mean)), 1e-9);
    EXPECT_NEAR(estimate.interval.high, 1 / (1 + std::exp(-half - odds_of_mean)), 1e-9);
    // What ends at the interval's ends has a p of 0.05; the mean itself one of 1.
    EXPECT_NEAR(share.p_value(estimate.interval.low), 0.05, 1e-9);
    EXPECT_NEAR(share.p_value(estimate.interval.high), 0.05, 1e-9);
    EXPECT_DOUBLE_EQ(share.p_value(0.75), 1);
    EXPECT_GT(share.p_value(0.7), share.p_value(0.6));
    EXPECT_EQ(share.estimate("because").too_few, "because");
}

TEST(CrossedShare, WhoeverHasNoValuesDoesNotCount) {
    auto more = materials;
    more.push_back({3});
    const auto there = CrossedShare(values, 2, materials, 3).estimate();
    const auto back = CrossedShare(values, 9, more, 7).estimate();
    EXPECT_EQ(there.interval.low, back.interval.low);
    EXPECT_EQ(there.interval.high, back.interval.high);
}

TEST(CrossedShare, TheOtherAnswerIsTheMirrorImage) {
    auto others = values;
    for (auto& value : others) {
        value.value = 1 - value.value;
    }
    const auto there = CrossedShare(values, 2, materials, 3).estimate();
    const auto back = CrossedShare(others, 2, materials, 3).estimate();
    EXPECT_NEAR(back.interval.low, 1 - there.interval.high, 1e-12);
    EXPECT_NEAR(back.interval.high, 1 - there.interval.low, 1e-12);
}

TEST(CrossedShare, WithoutAnInterval) {
    const auto reason = [](const std::vector<CrossedValue>& some,
                           const std::vector<std::vector<std::uint32_t>>& of) {
        const auto estimate = CrossedShare(some, 2, of, 3).estimate();
        EXPECT_EQ(std::isnan(estimate.interval.low), !estimate.too_few.empty());
        return estimate.too_few;
    };
    EXPECT_EQ(reason({{0, 0, 1}, {1, 1, 1}}, materials), "no judge or material makes a difference");
    EXPECT_EQ(reason({{0, 0, 0}, {1, 1, 0}}, materials), "no judge or material makes a difference");
    EXPECT_EQ(reason({{0, 0, 1}, {1, 1, 0}}, {{0, 1}, {0, 2}}),
              "one judge or material has all votes");
    EXPECT_EQ(reason({{0, 0, 1}, {0, 1, 0}}, materials), "one judge or material has all votes");
    EXPECT_EQ(reason(values, materials), "");
    EXPECT_TRUE(std::isnan(CrossedShare({}, 2, materials, 3).estimate("none").value));
}

}  // namespace
}  // namespace merl::scan
