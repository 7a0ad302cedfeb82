#include "engine/distance/host/float64_difference.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "tests/engine/support.h"

namespace merl::engine {
namespace {

constexpr std::array kDegrees = {2.0 / 3, 1.0, 2.0};

/// Half of an ulp of 1.
constexpr long double kRounding = 0x1p-53L;

/// Calls `test` once for every instruction set of this processor that Highway has code for.
void with_every_target(const std::function<void()>& test) {
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        SCOPED_TRACE(hwy::TargetName(target));
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        test();
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

long double power(long double x, double degree) {
    const auto root = std::cbrt(x);
    return degree < 1 ? root * root : degree == 1 ? x : x * x;
}

long double exact_sum(double degree, const ChannelSamples& a, const ChannelSamples& b,
                      const BlockWeights& weights) {
    long double sum = 0;
    for (std::size_t k = 0; k < a.size(); ++k) {
        const auto difference = static_cast<long double>(a[k]) - static_cast<long double>(b[k]);
        sum += static_cast<long double>(weights[k]) * power(std::abs(difference), degree);
    }
    return sum;
}

double sum_of(double degree, const ChannelSamples& a, const ChannelSamples& b,
              const BlockWeights& weights) {
    const ChannelSamples* const column = &b;
    double sum = -1;
    sum_float64_differences(degree, a, {&column, 1}, weights, {&sum, 1});
    return sum;
}

/// Numbers of many sizes and zeros, the next ones after them, tiny ones and huge ones.
std::vector<ChannelSamples> samples() {
    std::vector<ChannelSamples> all(7);
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        for (std::size_t m = 0; m < 3; ++m) {
            all[m][k] = test::random_sample(m, k, m);
        }
        all[3][k] = std::nextafter(all[0][k], 1e9);
        all[4][k] = all[0][k] * (1 + static_cast<double>(k % 5) * 0x1p-52);
        all[5][k] = std::ldexp(all[1][k], -400);
        all[6][k] = std::ldexp(all[2][k], 400);
    }
    return all;
}

BlockWeights some_weights() {
    BlockWeights weights = {};
    for (std::size_t k = 0; k < 1000; ++k) {
        weights[k] = 0.001 * static_cast<double>(1 + k * 7 % 999);
    }
    return weights;
}

TEST(Float64Difference, ErrorIsThatOfTheDerivationOnEveryInstructionSet) {
    const auto all = samples();
    const auto weights = some_weights();
    with_every_target([&] {
        for (const double degree : kDegrees) {
            for (std::size_t a = 1; a < all.size(); ++a) {
                for (std::size_t b = 0; b < a; ++b) {
                    const auto exact = exact_sum(degree, all[a], all[b], weights);
                    const auto found = sum_of(degree, all[a], all[b], weights);
                    EXPECT_LE(std::abs(found - exact), 135 * kRounding * exact)
                        << degree << ' ' << a << ' ' << b;
                }
            }
        }
    });
}

/// A single difference, so that nothing averages out.
TEST(Float64Difference, ThePowerIsOffByThreeRoundingsAtMost) {
    ChannelSamples a = {};
    const ChannelSamples zero = {};
    BlockWeights weights = {};
    weights[77] = 1;
    long double largest = 0;
    for (int i = 0; i < 200'000; ++i) {
        const double x = std::exp2(3.0 * i / 200'000 + (i % 4 == 0 ? 900 : -(i % 1000)));
        a[77] = x;
        const long double exact = power(x, 2.0 / 3);
        largest = std::max(largest, std::abs(sum_of(2.0 / 3, a, zero, weights) / exact - 1));
    }
    EXPECT_LT(largest, 3.1L * kRounding);
    EXPECT_GT(largest, 1.5L * kRounding);  // so that the test can see it
}

TEST(Float64Difference, HasTheSameBitsOnEveryInstructionSetAndBesideAnything) {
    const auto all = samples();
    const auto weights = some_weights();
    std::vector<std::vector<double>> results;
    with_every_target([&] {
        auto& result = results.emplace_back();
        for (const double degree : kDegrees) {
            for (std::size_t count = 1; count <= kFloat64Columns; ++count) {
                std::array<const ChannelSamples*, kFloat64Columns> columns = {};
                std::array<double, kFloat64Columns + 1> sums = {};
                sums[count] = -1;
                for (std::size_t c = 0; c < count; ++c) {
                    columns[c] = &all[c + 1];
                }
                sum_float64_differences(degree, all[0], std::span(columns).first(count), weights,
                                        sums);
                for (std::size_t c = 0; c < count; ++c) {
                    EXPECT_EQ(sums[c], sum_of(degree, all[0], all[c + 1], weights));
                    EXPECT_EQ(sums[c], sum_of(degree, all[c + 1], all[0], weights));
                    result.push_back(sums[c]);
                }
                EXPECT_EQ(sums[count], -1);
            }
        }
    });
    ASSERT_FALSE(results.empty());
    for (const auto& result : results) {
        EXPECT_EQ(result, results.front());
    }
}

TEST(Float64Difference, OfTheSameIsZero) {
    const auto all = samples();
    for (const double degree : kDegrees) {
        for (const auto& a : all) {
            EXPECT_EQ(sum_of(degree, a, a, some_weights()), 0);
        }
    }
}

}  // namespace
}  // namespace merl::engine
