#include "scan/statistics/clustered_figure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <vector>

namespace merl::scan {
namespace {

TEST(ClusteredFigure, EffectiveNumberOfClusters) {
    const auto number = [](std::vector<std::uint64_t> sizes) { return effective_clusters(sizes); };
    EXPECT_EQ(number({7, 7, 7, 7}), 4);
    EXPECT_EQ(number({7, 0, 7}), 2);
    EXPECT_DOUBLE_EQ(number({97, 1, 1, 1}), 1e4 / 9412);
    EXPECT_EQ(number({0, 0}), 0);
    EXPECT_EQ(number({}), 0);
}

// Each value its own cluster: the t interval of a mean. Quantile 0.975 of 4 degrees of freedom is
// 2.776445 in any table.
TEST(ClusteredFigure, IsStudentsIntervalOfAMean) {
    const std::vector<double> values = {2, 4, 4, 5, 10};
    ClusteredFigure mean{5, {}};
    for (const double value : values) {
        mean.influences.push_back((value - 5) / 5);
    }
    const auto estimate = estimated(mean, 5);
    const double error = std::sqrt(36.0 / 4 / 5);
    EXPECT_NEAR(estimate.interval.low, 5 - 2.776445 * error, 1e-5);
    EXPECT_NEAR(estimate.interval.high, 5 + 2.776445 * error, 1e-5);
    EXPECT_TRUE(clear_of_zero(estimate));
    // On the border of its interval a figure has p = 0.05.
    const ClusteredFigure border{estimate.interval.high - 5, mean.influences};
    EXPECT_NEAR(p_of_zero(border, 5), 0.05, 1e-12);
    EXPECT_NEAR(p_of_zero({-border.value, border.influences}, 5), 0.05, 1e-12);
    const auto negated = negative(estimate);
    EXPECT_EQ(negated.interval.low, -estimate.interval.high);
    EXPECT_TRUE(clear_of_zero(negated));
    EXPECT_EQ(within(6, estimate, 7).interval.low, 6);
    EXPECT_EQ(within(6, estimate, 7).interval.high, 7);
}

TEST(ClusteredFigure, DifferencesArePaired) {
    const ClusteredFigure first{0.75, {0.25, -0.25, 0.5}};
    const auto zero = difference(first, first);
    EXPECT_EQ(zero.value, 0);
    EXPECT_EQ(zero.influences, std::vector<double>(3));
    EXPECT_EQ(estimated(zero, 3).too_few, "all judgements are alike");
    const auto other = difference(first, {0.5, {0.5, 0, 0}});
    EXPECT_EQ(other.value, 0.25);
    EXPECT_EQ(other.influences, (std::vector<double>{-0.25, -0.25, 0.5}));
}

TEST(ClusteredFigure, NothingThatDiffersIsNoCertainty) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    const std::vector<ClusteredFigure> figures = {
        {1, {0, 0, 0}}, {1, {1e-17, -1e-17, 0}}, {infinity, {0, 0, 0}}, {std::nan(""), {1, 2, 3}}};
    for (const auto& figure : figures) {
        EXPECT_FALSE(estimated(figure, 3).too_few.empty());
        EXPECT_FALSE(clear_of_zero(estimated(figure, 3)));
        EXPECT_TRUE(std::isnan(estimated(figure, 3).interval.low));
        EXPECT_TRUE(std::isnan(p_of_zero(figure, 3)));
    }
    EXPECT_EQ(estimated({1, {1, -1}}, 2, "few").too_few, "few");
}

}  // namespace
}  // namespace merl::scan
