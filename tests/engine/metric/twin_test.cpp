#include <gtest/gtest.h>

#include <random>

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

}  // namespace
}  // namespace merl::engine
