#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <string>

#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "engine/metric/metric_header.h"
#include "engine/metric/metric_library.h"
#include "tests/engine/support.h"

namespace merl::engine {

/// tests/engine/metric/twins/, compiled by the build like the library.
std::span<const BuiltMetric> built_test_metrics();

namespace {

Metric test_metric() {
    const auto& built = built_test_metrics().front();
    Metric metric;
    metric.name = built.name;
    metric.file = "unspaced-header.glsl";
    metric.source = built.source;
    metric.header = parse_metric_header(metric.source, metric.file);
    metric.parameters = {5};
    metric.twin = built.twin;
    return metric;
}

TEST(Twin, SeesTheHeaderAndTheTypesThatShadersSee) {
    const Metric metric = test_metric();
    ASSERT_EQ(metric.header.parameters.size(), 1U);
    EXPECT_EQ(metric.header.parameters[0].name, "gain");
    const test::FunctionDatabase database({.theta_h = 7, .theta_d = 6, .phi_d = 8}, 4,
                                          test::random_sample);
    const Metric* const one[] = {&metric};
    const std::vector<MaterialPair> pairs = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};
    const auto exact = float64_distances(database, metric, pairs);
    for (const bool in_shaders : {false, true}) {
        const auto result = compute_distances(test::engines(in_shaders), database, one);
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            EXPECT_NEAR(result.distances[0].values[p] / exact[p], 1, 2e-6) << in_shaders;
        }
    }
    // The blue channel counts five times.
    BlockSamples samples = {};
    samples[2][0] = 3;
    BlockSamples transformed = {};
    const std::vector<Voxel> voxels(kBlockVoxels);
    metric.twin.transform(metric.parameters,
                          std::span<const Voxel, kBlockVoxels>(voxels.data(), kBlockVoxels),
                          samples, transformed);
    EXPECT_EQ(transformed[2][0], 15);
}

/// Of what is no norm too: the order of materials, which labels decide, changes no bit.
TEST(Twin, DifferencesAreTheSameInBothOrders) {
    const Metric& metric = find_metric("paw-ciede2000");
    std::mt19937 random(1);
    std::uniform_real_distribution<double> lightness(0, 100);
    std::uniform_real_distribution<double> opponent(-80, 80);
    BlockSamples a = {};
    BlockSamples b = {};
    BlockWeights weights;
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        weights = {};
        weights[k] = 1;  // a single one, so that every voxel is compared
        for (auto* colour : {&a, &b}) {
            (*colour)[0][k] = lightness(random);
            (*colour)[1][k] = opponent(random);
            (*colour)[2][k] = opponent(random);
        }
        const double there = metric.twin.sum(metric.parameters, a, b, weights);
        EXPECT_GT(there, 0);
        EXPECT_EQ(there, metric.twin.sum(metric.parameters, b, a, weights));
    }
}

using Lab = std::array<double, 3>;

/// The difference of a single voxel under paw-ciede2000, with weight 1.
double ciede2000_squared(const Lab& one, const Lab& other) {
    const Metric& metric = find_metric("paw-ciede2000");
    BlockSamples a = {};
    BlockSamples b = {};
    BlockWeights weights = {};
    weights[0] = 1;
    for (std::size_t i = 0; i < 3; ++i) {
        a[i][0] = one[i];
        b[i][0] = other[i];
    }
    return metric.twin.sum(metric.parameters, a, b, weights);
}

/// The same as CIE 142:2001 defines it, hue by hue in degrees and case by case.
long double textbook_ciede2000_squared(const Lab& one, const Lab& other) {
    constexpr long double kDegree = std::numbers::pi_v<long double> / 180;
    const auto share = [](long double chroma) {
        return std::sqrt(std::pow(chroma, 7.0L) / (std::pow(chroma, 7.0L) + std::pow(25.0L, 7.0L)));
    };
    const auto chroma_of = [](const Lab& lab) {
        return std::hypot(static_cast<long double>(lab[1]), static_cast<long double>(lab[2]));
    };
    const long double g = (1 - share((chroma_of(one) + chroma_of(other)) / 2)) / 2;
    std::array<long double, 2> c = {};
    std::array<long double, 2> h = {};
    for (std::size_t i = 0; i < 2; ++i) {
        const Lab& lab = i == 0 ? one : other;
        const long double a = (1 + g) * static_cast<long double>(lab[1]);
        const auto b = static_cast<long double>(lab[2]);
        c[i] = std::hypot(a, b);
        h[i] = c[i] > 0 ? std::atan2(b, a) / kDegree : 0;
        h[i] += h[i] < 0 ? 360 : 0;
    }
    long double apart = c[0] * c[1] > 0 ? h[1] - h[0] : 0;
    long double hue = c[0] * c[1] > 0 ? (h[0] + h[1]) / 2 : h[0] + h[1];
    if (std::abs(apart) > 180) {
        apart += apart > 0 ? -360 : 360;
        hue += hue < 180 ? 180 : -180;
    }
    const long double l =
        (static_cast<long double>(one[0]) + static_cast<long double>(other[0])) / 2;
    const long double mean = (c[0] + c[1]) / 2;
    const long double t =
        1 - 0.17L * std::cos((hue - 30) * kDegree) + 0.24L * std::cos(2 * hue * kDegree) +
        0.32L * std::cos((3 * hue + 6) * kDegree) - 0.20L * std::cos((4 * hue - 63) * kDegree);
    // The definition takes 275 from hues of 0 to 360 degrees, here and in the file the way round is
    // the shorter one: 1e-8 of the rotation where that matters.
    const long double from_blue = std::remainder(hue - 275, 360.0L) / 25;
    const long double turn = 30 * std::exp(-from_blue * from_blue);
    const long double rotation = -2 * share(mean) * std::sin(2 * turn * kDegree);
    const long double dl = (static_cast<long double>(other[0]) - static_cast<long double>(one[0])) /
                           (1 + 0.015L * (l - 50) * (l - 50) / std::sqrt(20 + (l - 50) * (l - 50)));
    const long double dc = (c[1] - c[0]) / (1 + 0.045L * mean);
    const long double dh =
        2 * std::sqrt(c[0] * c[1]) * std::sin(apart / 2 * kDegree) / (1 + 0.015L * mean * t);
    return dl * dl + dc * dc + dh * dh + rotation * dc * dh;
}

/// Also where hues are nearly opposite: there sums of directions cancel, and the mean hue jumps.
TEST(Twin, Ciede2000IsThatOfTheTextbook) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> lightness(0, 100);
    std::uniform_real_distribution<double> opponent(-80, 80);
    std::uniform_real_distribution<double> length(0.1, 3);
    for (const double scatter : {0.0, 80.0, 1.0, 1e-2, 1e-4, 1e-6}) {
        std::uniform_real_distribution<double> off(-scatter, scatter);
        for (int i = 0; i < 2000; ++i) {
            const Lab one = {lightness(random), opponent(random), opponent(random)};
            const double far = length(random);
            const Lab other = scatter == 0
                                  ? Lab{lightness(random), opponent(random), opponent(random)}
                                  : Lab{lightness(random), -far * one[1] + off(random),
                                        -far * one[2] + off(random)};
            const auto expected = static_cast<double>(textbook_ciede2000_squared(one, other));
            EXPECT_NEAR(ciede2000_squared(one, other), expected, 1e-12 * expected)
                << scatter << ' ' << one[1] << ' ' << one[2] << ' ' << other[1] << ' ' << other[2];
        }
    }
    EXPECT_NEAR(ciede2000_squared({50, 3, 4}, {50, -6, -8}),
                static_cast<double>(textbook_ciede2000_squared({50, 3, 4}, {50, -6, -8})), 1e-11);
    EXPECT_NEAR(ciede2000_squared({50, 0, 0}, {50, 3, 4}),
                static_cast<double>(textbook_ciede2000_squared({50, 0, 0}, {50, 3, 4})), 1e-12);
    for (const double chroma : {0.0, 1e-79, 1e-30, 1e-13, 1e-3}) {
        EXPECT_EQ(ciede2000_squared({50, chroma, chroma / 2}, {50, chroma, chroma / 2}), 0);
    }
}

/// How far a difference in float32 may be from that in float64, in units of the last digit.
constexpr double kLastDigits = 64;

/// Colours in CIELAB, as a block of either kind: the same numbers.
struct Colours {
    std::unique_ptr<BlockSamples> in_float64 = std::make_unique<BlockSamples>();
    std::unique_ptr<BlockScalars> in_float32 = std::make_unique<BlockScalars>();

    void set(std::size_t k, const std::array<float, 3>& lab) {
        for (std::size_t i = 0; i < 3; ++i) {
            (*in_float64)[i][k] = static_cast<double>(lab[i]);
            (*in_float32)[i * kBlockVoxels + k] = lab[i];
        }
    }
};

/// Every voxel alone in float32 and in float64, and in both orders in float32.
void expect_near_in_float32(const std::string& what,
                            const std::function<std::array<float, 3>(std::size_t)>& first,
                            const std::function<std::array<float, 3>(std::size_t)>& second) {
    const Metric& metric = find_metric("paw-ciede2000");
    ASSERT_NE(metric.twin.sum_in_float32, nullptr);
    Colours a;
    Colours b;
    double worst = 0;
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        a.set(k, first(k));
        b.set(k, second(k));
    }
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        BlockWeights weights = {};
        SingleWeights single_weights = {};
        weights[k] = 1;
        single_weights[k] = 1;
        const auto in_float32 = [&](const Colours& x, const Colours& y) {
            return metric.twin.sum_in_float32(metric.parameters, *x.in_float32, *y.in_float32,
                                              single_weights);
        };
        const double there = in_float32(a, b);
        EXPECT_EQ(there, in_float32(b, a)) << what;
        const double exact =
            std::sqrt(metric.twin.sum(metric.parameters, *a.in_float64, *b.in_float64, weights));
        double largest = 0;
        for (std::size_t i = 0; i < 3; ++i) {
            largest = std::max(
                {largest, std::abs((*a.in_float64)[i][k]), std::abs((*b.in_float64)[i][k])});
        }
        // The difference, and the last digits of the colours themselves.
        const double unit = 0x1p-23 * (exact + largest) + 1e-18;
        worst = std::max(worst, std::abs(std::sqrt(there) - exact) / unit);
    }
    EXPECT_LT(worst, kLastDigits) << what;
}

TEST(Twin, InFloat32IsThatInFloat64) {
    std::mt19937 random(1);
    const auto between = [&](float low, float high) {
        return std::uniform_real_distribution<float>(low, high)(random);
    };
    std::array<float, 3> kept = {};
    const auto colour = [&](float chroma) {
        return [&, chroma](std::size_t) -> std::array<float, 3> {
            return {between(0, 100), between(-chroma, chroma), between(-chroma, chroma)};
        };
    };
    expect_near_in_float32("colours", colour(80), colour(80));
    expect_near_in_float32("highlights", colour(1e4F), colour(1e4F));
    expect_near_in_float32("highlights and colours", colour(1e4F), colour(80));
    expect_near_in_float32("almost grey", colour(1e-3F), colour(1e-3F));
    expect_near_in_float32("almost grey and colours", colour(1e-3F), colour(80));
    expect_near_in_float32("dark", colour(1e-12F), colour(1e-12F));
    const auto grey = [&](std::size_t) -> std::array<float, 3> { return {between(0, 100), 0, 0}; };
    expect_near_in_float32("grey", grey, grey);
    expect_near_in_float32("grey and colours", grey, colour(80));
    const auto black = [](std::size_t) -> std::array<float, 3> { return {}; };
    expect_near_in_float32("black", black, black);
    expect_near_in_float32("black and colours", black, colour(80));
    // Colours in a row, so that the second can be made from the first.
    const auto row = [](std::size_t k) -> std::array<float, 3> {
        const auto x = static_cast<float>(k);
        return {50, 60 * std::cos(x), 60 * std::sin(x)};
    };
    for (const float step : {1e-1F, 1e-3F, 1e-5F}) {
        expect_near_in_float32("near", row, [&](std::size_t k) {
            kept = row(k);
            return std::array<float, 3>{kept[0] + step, kept[1] - step, kept[2] + step};
        });
    }
    expect_near_in_float32("equal", row, row);
    expect_near_in_float32("opposite", row, [&](std::size_t k) {
        kept = row(k);
        return std::array<float, 3>{kept[0], -kept[1], -kept[2]};
    });
    expect_near_in_float32(
        "around blue",
        [&](std::size_t) {
            return std::array<float, 3>{between(20, 60), between(-10, 20), between(-90, -30)};
        },
        [&](std::size_t) {
            return std::array<float, 3>{between(20, 60), between(-10, 20), between(-90, -30)};
        });
}

/// The sum of a whole block is in float64.
TEST(Twin, SumsInFloat32ToTheLastDigits) {
    const Metric& metric = find_metric("paw-ciede2000");
    std::mt19937 random(2);
    std::uniform_real_distribution<float> number(0, 60);
    Colours a;
    Colours b;
    BlockWeights weights;
    SingleWeights single_weights;
    for (std::size_t k = 0; k < kBlockVoxels; ++k) {
        a.set(k, {number(random), number(random), number(random)});
        b.set(k, {number(random), number(random), number(random)});
        single_weights[k] = number(random);
        weights[k] = static_cast<double>(single_weights[k]);
    }
    const double sum =
        metric.twin.sum_in_float32(metric.parameters, *a.in_float32, *b.in_float32, single_weights);
    EXPECT_NEAR(sum / metric.twin.sum(metric.parameters, *a.in_float64, *b.in_float64, weights), 1,
                1e-6);
}

TEST(Twin, OnlyAMetricWithoutADegreeIsSummedInFloat32) {
    for (const auto& metric : metrics()) {
        EXPECT_EQ(metric.twin.sum_in_float32 != nullptr,
                  !metric.has_degree() && !metric.is_summary())
            << metric.name;
    }
}

}  // namespace
}  // namespace merl::engine
