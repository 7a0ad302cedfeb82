#include "scan/statistics/bootstrap.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <vector>

namespace merl::scan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Resample, DrawsAsManyAsThereAre) {
    for (const std::uint32_t clusters : {1U, 2U, 7U, 1000U}) {
        const auto times = resample(1, 5, clusters);
        ASSERT_EQ(times.size(), clusters);
        EXPECT_EQ(std::accumulate(times.begin(), times.end(), 0U), clusters);
    }
}

TEST(Resample, IsReproducibleAndDiffers) {
    EXPECT_EQ(resample(3, 8, 100), resample(3, 8, 100));
    EXPECT_NE(resample(3, 8, 100), resample(3, 9, 100));
    EXPECT_NE(resample(3, 8, 100), resample(4, 8, 100));
    EXPECT_NE(resample(3, 8, 100), resample(3 + (1ULL << 32U), 8, 100));
}

// The number of times a cluster is drawn is binomial (n, 1/n): mean 1, variance 1 - 1/n.
TEST(Resample, IsUniform) {
    constexpr std::uint32_t clusters = 20;
    constexpr std::uint32_t samples = 20'000;
    std::vector<double> sum(clusters);
    double squares = 0;
    for (std::uint32_t i = 0; i < samples; ++i) {
        const auto times = resample(1, i, clusters);
        for (std::uint32_t c = 0; c < clusters; ++c) {
            sum[c] += times[c];
            squares += (times[c] - 1.0) * (times[c] - 1.0);
        }
    }
    for (const double s : sum) {
        EXPECT_NEAR(s / samples, 1, 5 / std::sqrt(samples));
    }
    EXPECT_NEAR(squares / samples / clusters, 0.95, 0.02);
}

// Expected: numpy.percentile (numpy 1.24.2) at 2.5 and 97.5.
TEST(PercentileInterval, IsThatOfNumpy) {
    const std::vector<double> values = {3, 1, 4, 1, 5, 9, 2, 6, 5, 3, 5};
    const auto [low, high] = percentile_interval(values);
    EXPECT_DOUBLE_EQ(low, 1);
    EXPECT_DOUBLE_EQ(high, 8.25);
}

TEST(PercentileInterval, TakesInfinitiesAndLeavesOutNaN) {
    const std::vector<double> values = {1, kInfinity, std::nan(""), kInfinity, kInfinity, 2};
    const auto [low, high] = percentile_interval(values);
    EXPECT_DOUBLE_EQ(low, 1.1);
    EXPECT_EQ(high, kInfinity);
    const auto none = percentile_interval({});
    EXPECT_TRUE(std::isnan(none.low) && std::isnan(none.high));
    const std::vector<double> one = {7};
    EXPECT_EQ(percentile_interval(one).low, 7);
}

}  // namespace
}  // namespace merl::scan
