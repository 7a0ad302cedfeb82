#include "scan/statistics/rank_correlation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace merl::scan {
namespace {

using ::testing::Each;
using Values = std::vector<double>;

/// 7 i^2 + 3 i modulo m.
Values first(std::int64_t n, std::int64_t m) {
    Values x;
    for (std::int64_t i = 0; i < n; ++i) {
        x.push_back(static_cast<double>((7 * i * i + 3 * i) % m));
    }
    return x;
}

/// 5 i^2 + i + 2 x modulo m.
Values second(const Values& x, std::int64_t m) {
    Values y;
    for (std::size_t k = 0; k < x.size(); ++k) {
        const auto i = static_cast<std::int64_t>(k);
        y.push_back(static_cast<double>((5 * i * i + i + 2 * static_cast<std::int64_t>(x[k])) % m));
    }
    return y;
}

// Expected: scipy.stats.spearmanr(x, y) and kendalltau(x, y) of scipy 1.10.1, of
//   x = [(7 * i * i + 3 * i) % mx for i in range(n)]
//   y = [(5 * i * i + i + 2 * x[i]) % my for i in range(n)]
TEST(RankCorrelation, IsThatOfScipyWithAndWithoutTies) {
    const auto expect = [](std::int64_t n, std::int64_t mx, std::int64_t my, double rho,
                           double tau) {
        const auto x = first(n, mx);
        const auto y = second(x, my);
        EXPECT_NEAR(spearman(x, y).value, rho, 1e-12) << n;
        EXPECT_NEAR(kendall(x, y).value, tau, 1e-12) << n;
        EXPECT_NEAR(spearman(y, x).value, rho, 1e-12) << n;
        EXPECT_NEAR(kendall(y, x).value, tau, 1e-12) << n;
    };
    expect(60, 23, 17, -0.04099497753993426, -0.02713398850571077);
    expect(1000, 7, 5, 0.002817497018416134, 0.002197895621529671);
    expect(200, 100003, 100019, 0.3371499287482187, 0.2637185929648241);
    // y = [x[i] // 3 + (i * i) % 3 for i in range(500)], mx = 23
    const auto x = first(500, 23);
    Values y;
    for (std::size_t i = 0; i < x.size(); ++i) {
        y.push_back(std::floor(x[i] / 3) + static_cast<double>((i * i) % 3));
    }
    EXPECT_NEAR(spearman(x, y).value, 0.9568888331765324, 1e-12);
    EXPECT_NEAR(kendall(x, y).value, 0.8877108059211793, 1e-12);
    const Values few = {1, 2, 2, 3, 3, 3, 10};
    const Values others = {0.5, 0.5, 2, 2, 1, 3, 3};
    EXPECT_NEAR(spearman(few, others).value, 0.7693730481128204, 1e-12);
    EXPECT_NEAR(kendall(few, others).value, 0.6859943405700354, 1e-12);
}

TEST(RankCorrelation, OfItselfAndItsOpposite) {
    const auto x = first(60, 23);
    Values opposite;
    for (const double v : x) {
        opposite.push_back(-v);
    }
    for (const auto& correlation : {spearman, kendall}) {
        EXPECT_EQ(correlation(x, x).value, 1);
        EXPECT_EQ(correlation(x, opposite).value, -1);
        for (const double influence : correlation(x, x).influences) {
            EXPECT_NEAR(influence, 0, 1e-12);
        }
    }
}

TEST(RankCorrelation, IsNoneWhereNothingVaries) {
    for (const auto& correlation : {spearman, kendall}) {
        const auto none = correlation(Values{1, 1, 1}, Values{1, 2, 3});
        EXPECT_TRUE(std::isnan(none.value));
        EXPECT_THAT(none.influences, Each(0));
        EXPECT_TRUE(std::isnan(correlation(Values{1, 2}, Values{4, 4}).value));
        EXPECT_TRUE(std::isnan(correlation(Values{1}, Values{1}).value));
        EXPECT_TRUE(std::isnan(correlation(Values{}, Values{}).value));
    }
}

double sign(double x) {
    return x > 0 ? 1 : x < 0 ? -1 : 0;
}

/// The correlations of observations that count as often as they weigh, by the definitions.
struct Weighted {
    double rho = 0;
    double tau = 0;

    Weighted(const Values& x, const Values& y, const Values& w) {
        double s = 0;
        double a = 0;
        double b = 0;
        double cov = 0;
        double var_x = 0;
        double var_y = 0;
        for (std::size_t i = 0; i < x.size(); ++i) {
            double rank_x = 0;
            double rank_y = 0;
            for (std::size_t j = 0; j < x.size(); ++j) {
                const double dx = sign(x[i] - x[j]);
                const double dy = sign(y[i] - y[j]);
                s += w[i] * w[j] * dx * dy;
                a += w[i] * w[j] * dx * dx;
                b += w[i] * w[j] * dy * dy;
                rank_x += w[j] * dx;
                rank_y += w[j] * dy;
            }
            cov += w[i] * rank_x * rank_y;
            var_x += w[i] * rank_x * rank_x;
            var_y += w[i] * rank_y * rank_y;
        }
        tau = s / std::sqrt(a * b);
        rho = cov / std::sqrt(var_x * var_y);
    }
};

TEST(RankCorrelation, InfluencesAreWhatAWeightDoes) {
    const auto x = first(60, 23);
    auto y = second(x, 17);
    for (std::size_t i = 0; i < y.size(); i += 2) {
        y[i] += x[i];
    }
    const auto rho = spearman(x, y);
    const auto tau = kendall(x, y);
    constexpr double step = 1e-4;
    for (std::size_t k = 0; k < x.size(); ++k) {
        Values more(x.size(), 1);
        Values less(x.size(), 1);
        more[k] += step;
        less[k] -= step;
        const Weighted up(x, y, more);
        const Weighted down(x, y, less);
        EXPECT_NEAR(rho.influences[k], (up.rho - down.rho) / (2 * step), 1e-9);
        EXPECT_NEAR(tau.influences[k], (up.tau - down.tau) / (2 * step), 1e-9);
    }
}

}  // namespace
}  // namespace merl::scan
