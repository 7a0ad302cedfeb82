#include "engine/distance/float64_distances.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <vector>

#include "tests/engine/support.h"

namespace merl::engine {
namespace {

TEST(Reference, DoesNotDependOnMemoryOrThreads) {
    const test::FunctionDatabase database({.theta_h = 9, .theta_d = 10, .phi_d = 40}, 23,
                                          test::random_sample);
    std::array<Float64Request, 2> requests = {
        {{&find_metric("cwcbrt"), {}}, {&find_metric("pawcielab"), {}}}};
    for (std::uint32_t a = 0; a < 23; ++a) {
        for (std::uint32_t b = 22; b > a; --b) {  // in no order that anything could rest on
            requests[0].pairs.emplace_back(a, b);
            if ((a + b) % 3 == 0) {
                requests[1].pairs.emplace_back(b, a);
            }
        }
    }
    const auto expected = float64_distances(database, requests);
    ASSERT_EQ(expected[0].size(), 253U);
    ASSERT_EQ(expected[1].size(), requests[1].pairs.size());
    for (const std::size_t threads : {1U, 2U, 5U}) {
        const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
        for (const std::uint64_t memory : {0U, 1'000'000U, 3'000'000U, 9'000'000U}) {
            EXPECT_EQ(float64_distances(database, requests, VoxelSet::above_horizon, {}, memory),
                      expected)
                << memory << " bytes, " << threads << " threads";
        }
    }
}

TEST(Reference, ProgressGoesFromNothingToAllHoweverOftenMaterialsAreRead) {
    const test::FunctionDatabase database({.theta_h = 9, .theta_d = 10, .phi_d = 40}, 9,
                                          test::random_sample);
    Float64Request request = {&find_metric("rmse"), {}};
    for (std::uint32_t a = 0; a < 9; ++a) {
        for (std::uint32_t b = a + 1; b < 9; ++b) {
            request.pairs.emplace_back(a, b);
        }
    }
    for (const std::uint64_t memory : {std::uint64_t{0}, std::uint64_t{1} << 30U}) {
        std::vector<double> shares;
        float64_distances(
            database, {&request, 1}, VoxelSet::above_horizon,
            [&](double share) { shares.push_back(share); }, memory);
        EXPECT_TRUE(std::is_sorted(shares.begin(), shares.end()));
        EXPECT_GT(shares.front(), 0);
        EXPECT_DOUBLE_EQ(shares.back(), 1);
    }
}

TEST(Reference, OfNothingIsNothing) {
    const test::FunctionDatabase database({.theta_h = 2, .theta_d = 2, .phi_d = 2}, 2,
                                          test::random_sample);
    EXPECT_TRUE(float64_distances(database, {}).empty());
    const Float64Request none = {&find_metric("rmse"), {}};
    EXPECT_EQ(float64_distances(database, {&none, 1}), std::vector(1, std::vector<double>()));
}

}  // namespace
}  // namespace merl::engine
