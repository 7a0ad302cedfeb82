#include "engine/distance/vulkan/vulkan_float64.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::FunctionDatabase;

constexpr std::uint64_t kMiB = 1ULL << 20U;

/// A metric of the library as if a user had copied its file.
Metric copy_of(const std::string& text) {
    Metric metric = open_metric(text);
    metric.twin = {};
    return metric;
}

std::vector<MaterialPair> all_pairs(std::uint32_t materials) {
    std::vector<MaterialPair> pairs;
    for (std::uint32_t i = 0; i < materials; ++i) {
        for (std::uint32_t j = i + 1; j < materials; ++j) {
            pairs.emplace_back(i, j);
        }
    }
    return pairs;
}

std::vector<double> on_device(const Database& database, const Metric& metric,
                              const std::vector<MaterialPair>& pairs,
                              VoxelSet set = VoxelSet::above_horizon,
                              std::uint64_t memory = 1024 * kMiB,
                              device::Context& context = test::lavapipe()) {
    const Float64Pairs request = {&metric, pairs};
    return vulkan_float64_distances(context, database, {&request, 1}, set, {}, memory).front();
}

/// Every degree, every function that a twin computes elsewhere; several blocks, the last not full.
TEST(VulkanFloat64, IsWhatTheTwinsCompute) {
    const FunctionDatabase database({.theta_h = 15, .theta_d = 14, .phi_d = 13}, 7,
                                    test::random_sample);
    const auto pairs = all_pairs(7);
    for (const auto& metric : metrics()) {
        if (!metric.has_degree()) {
            continue;
        }
        const auto expected = float64_distances(database, metric, pairs);
        const auto actual = on_device(database, copy_of(metric.name), pairs);
        ASSERT_EQ(actual.size(), expected.size());
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            EXPECT_NEAR(actual[p] / expected[p], 1, 1e-13) << metric.name;
        }
    }
}

/// Of materials that are nearly alike the difference is what is left of large numbers.
TEST(VulkanFloat64, SubtractsBeforeItWeighs) {
    const FunctionDatabase database({.theta_h = 9, .theta_d = 9, .phi_d = 9}, 4,
                                    [](std::size_t material, std::uint64_t voxel, std::size_t c) {
                                        return test::random_sample(0, voxel, c) *
                                               (1 + 1e-12 * static_cast<double>(material));
                                    });
    for (const char* name : {"cwcbrt", "rmse", "cosine-rmse"}) {
        const auto pairs = all_pairs(4);
        const auto expected = float64_distances(database, find_metric(name), pairs);
        const auto actual = on_device(database, copy_of(name), pairs);
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            EXPECT_GT(expected[p], 0);
            EXPECT_NEAR(actual[p] / expected[p], 1, 1e-13) << name;
        }
    }
}

TEST(VulkanFloat64, OfCopiesIsZeroAndOfTinySamplesHasItsDigits) {
    // Squares of differences are far below the range of float64.
    const FunctionDatabase database(
        {.theta_h = 6, .theta_d = 5, .phi_d = 4}, 6,
        [](std::size_t material, std::uint64_t voxel, std::size_t c) {
            const auto of = material == 5 ? 4 : material;  // the last two are alike
            return std::abs(test::random_sample(of, voxel, c)) * (of < 3 ? 1e-200 : 1);
        });
    const auto pairs = all_pairs(6);
    for (const char* name : {"rmse", "cwcbrt", "nbrdf-loss", "cosine-rmse"}) {
        const auto expected = float64_distances(database, find_metric(name), pairs);
        const auto actual = on_device(database, copy_of(name), pairs);
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            if (pairs[p] == MaterialPair{4, 5}) {
                EXPECT_EQ(actual[p], 0) << name;
            } else {
                EXPECT_GT(expected[p], 0) << name;
                EXPECT_NEAR(actual[p] / expected[p], 1, 1e-13) << name;
            }
        }
    }
}

TEST(VulkanFloat64, HasTheSameBitsHoweverItIsComputed) {
    const FunctionDatabase database({.theta_h = 20, .theta_d = 18, .phi_d = 21}, 9,
                                    test::random_sample);
    const auto pairs = all_pairs(9);
    const Metric metric = copy_of("cwcbrt");
    const auto all = on_device(database, metric, pairs);
    // Little memory: one block at a time, then groups of materials; one thread; copies.
    for (const std::uint64_t memory : {8 * kMiB, kMiB, kMiB / 2, std::uint64_t{1}}) {
        EXPECT_EQ(on_device(database, metric, pairs, VoxelSet::above_horizon, memory), all)
            << memory;
    }
    {
        const tbb::global_control one(tbb::global_control::max_allowed_parallelism, 1);
        EXPECT_EQ(on_device(database, metric, pairs), all);
    }
    EXPECT_EQ(on_device(database, metric, pairs, VoxelSet::above_horizon, 1024 * kMiB,
                        test::lavapipe_with_staging()),
              all);
    // Some, in another order, and turned round.
    const std::vector<MaterialPair> some = {{8, 3}, {0, 1}, {4, 2}};
    const auto found = on_device(database, metric, some);
    for (std::size_t p = 0; p < some.size(); ++p) {
        const MaterialPair sorted = {std::min(some[p].first, some[p].second),
                                     std::max(some[p].first, some[p].second)};
        EXPECT_EQ(found[p],
                  all[static_cast<std::size_t>(std::ranges::find(pairs, sorted) - pairs.begin())]);
    }
}

/// Those with a twin on the host, those without on the device, each in its place.
TEST(VulkanFloat64, EnginesShareByTheTwin) {
    const FunctionDatabase database({.theta_h = 8, .theta_d = 7, .phi_d = 6}, 5,
                                    test::random_sample);
    const Metric copy = copy_of("pawcielab");
    const std::vector<Float64Request> requests = {{&copy, {{0, 1}, {2, 3}}},
                                                  {&find_metric("pawcielab"), {{2, 3}, {0, 1}}},
                                                  {&copy, {}},
                                                  {&find_metric("rmse"), {{1, 4}}}};
    for (auto* engines : {&test::host_engines(), &test::shader_engines()}) {
        double last = 0;
        const auto found = engines->float64_distances(
            database, requests,
            [&](double share) {
                EXPECT_GE(share, last);
                last = share;
            },
            1024 * kMiB);
        EXPECT_DOUBLE_EQ(last, 1);
        ASSERT_EQ(found.size(), 4U);
        EXPECT_TRUE(found[2].empty());
        EXPECT_NEAR(found[0][0] / found[1][1], 1, 1e-13);
        EXPECT_NEAR(found[0][1] / found[1][0], 1, 1e-13);
        EXPECT_EQ(found[1],
                  float64_distances(database, find_metric("pawcielab"), requests[1].pairs));
        EXPECT_EQ(found[3], float64_distances(database, find_metric("rmse"), requests[3].pairs));
    }
}

/// The bound of a float32 distance holds for what the device makes of a user's file.
TEST(VulkanFloat64, IsWithinTheBoundOfFloat32) {
    const FunctionDatabase database({.theta_h = 12, .theta_d = 11, .phi_d = 10}, 8,
                                    test::random_sample);
    const auto pairs = all_pairs(8);
    for (const char* name : {"cwcbrt", "pawcielab", "nbrdf-loss"}) {
        const Metric copy = copy_of(name);
        const Metric* const one[] = {&copy};
        const auto found = compute_distances(test::shader_engines(), database, one).distances[0];
        const auto exact = on_device(database, copy, pairs);
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            EXPECT_LE(std::abs(found.values[p] - exact[p]), found.bounds[p]) << name;
            EXPECT_LT(found.bounds[p], 1e-4 * exact[p]) << name;
        }
    }
}

TEST(VulkanFloat64, EndsWhenProgressThrows) {
    const FunctionDatabase database({.theta_h = 20, .theta_d = 18, .phi_d = 21}, 3,
                                    test::random_sample);
    const Metric metric = copy_of("rmse");
    const Float64Pairs request = {&metric, {{0, 1}, {1, 2}}};
    EXPECT_THROW(vulkan_float64_distances(
                     test::lavapipe(), database, {&request, 1}, VoxelSet::above_horizon,
                     [](double) { throw std::runtime_error("enough"); }, kMiB / 2),
                 std::runtime_error);
}

TEST(VulkanFloat64, RefusesASumThatIsNoNumber) {
    const FunctionDatabase database({.theta_h = 4, .theta_d = 4, .phi_d = 4}, 2,
                                    test::random_sample);
    const Metric metric = test::metric_of(
        "// degree: 2\n"
        "vec3 transform(vec3 f, Voxel v) { return f * 1e160; }\n"
        "float weight(Voxel v) { return 1.0; }\n"
        "float difference(float d) { return d * d; }\n");
    test::expect_refused([&] { on_device(database, metric, {{0, 1}}); }, "in float64 is inf");
}

}  // namespace
}  // namespace merl::engine
