#include "engine/distance/float64_distances.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "engine/distance/parts/block_reader.h"
#include "engine/distance/parts/slab.h"
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

/// E of two materials in long double, from the twin's transformed samples and weights.
long double plain_distance(const Database& database, const Metric& metric, std::uint32_t a,
                           std::uint32_t b) {
    const Domain domain(database.grid());
    const VoxelList list(domain, VoxelSet::above_horizon);
    const Slab slab(domain, list, 0, list.size());
    std::array<std::vector<BlockSamples>, 2> samples;
    for (std::size_t i = 0; i < 2; ++i) {
        samples[i].resize(slab.blocks());
        read_blocks(database, i == 0 ? a : b, {0, database.grid().voxels()}, slab.runs, samples[i]);
    }
    const auto degree = static_cast<long double>(metric.header.degree);
    long double sum = 0;
    for (std::uint64_t block = 0; block < slab.blocks(); ++block) {
        BlockWeights weights = {};
        weigh_block(metric, slab, block, weights);
        std::array<BlockSamples, 2> of;
        for (std::size_t i = 0; i < 2; ++i) {
            metric.twin.transform(metric.parameters, slab.voxels_of_block(block), samples[i][block],
                                  of[i]);
        }
        for (std::size_t channel = 0; channel < 3; ++channel) {
            for (std::size_t k = 0; k < kBlockVoxels; ++k) {
                const long double d = std::abs(static_cast<long double>(of[0][channel][k]) -
                                               static_cast<long double>(of[1][channel][k]));
                const long double root = std::cbrt(d);
                sum += static_cast<long double>(weights[k]) * (degree < 1    ? root * root
                                                               : degree == 1 ? d
                                                                             : d * d);
            }
        }
    }
    return std::sqrt(sum / static_cast<long double>(database.grid().voxels()));
}

/// Near-equal blends, weights 1e-12 to 1e-16 apart, beside others, copies, and tiny ones.
TEST(Reference, ErrorIsBelowTenToTheMinusFourteen) {
    const Grid grid = {.theta_h = 9, .theta_d = 10, .phi_d = 40};
    constexpr std::array kWeights = {0.0, 1e-16, 1e-15, 1e-14, 1e-13, 1e-12, 0.25, 0.25, 1.0};
    const test::FunctionDatabase database(
        grid, kWeights.size() + 2, [&](std::size_t m, std::uint64_t voxel, std::size_t channel) {
            const double a = test::random_sample(0, voxel, channel);
            const double b = test::random_sample(1, voxel, channel);
            const double w = m < kWeights.size() ? kWeights[m] : 0.5;
            const double blend = std::abs(a) + w * (std::abs(b) - std::abs(a));
            return m < kWeights.size() ? blend : std::ldexp(blend, m == kWeights.size() ? -60 : 20);
        });
    std::size_t with_degree = 0;
    for (const auto& metric : metrics()) {
        if (metric.is_summary() || metric.header.degree == 0) {
            continue;
        }
        ++with_degree;
        std::vector<MaterialPair> pairs;
        for (std::uint32_t a = 0; a < database.materials().size(); ++a) {
            for (std::uint32_t b = a + 1; b < database.materials().size(); ++b) {
                pairs.emplace_back(a, b);
            }
        }
        const auto found = float64_distances(database, metric, pairs);
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            const auto exact = plain_distance(database, metric, pairs[p].first, pairs[p].second);
            EXPECT_LE(std::abs(found[p] - exact), 1e-14L * exact)
                << metric.name << ' ' << pairs[p].first << ' ' << pairs[p].second;
        }
    }
    EXPECT_GE(with_degree, 5U);
}

/// Where all that differs has no weight the sum is 0, and is computed again with scaled samples.
TEST(Reference, OfWhatDiffersWithoutWeightIsZero) {
    const Grid grid = {.theta_h = 11, .theta_d = 10, .phi_d = 40};
    const test::FunctionDatabase database(
        grid, 3, [&](std::size_t m, std::uint64_t voxel, std::size_t channel) {
            const auto theta_d = voxel / grid.phi_d % grid.theta_d;
            const bool differs = m == 1 ? theta_d > grid.theta_d / 2 : m == 2;
            return 1.0 + static_cast<double>(channel) + (differs ? 1e9 : 0.0);
        });
    constexpr std::array<MaterialPair, 3> kPairs = {{{0, 1}, {0, 2}, {1, 2}}};
    const auto distances = float64_distances(database, find_metric("window-log"), kPairs);
    EXPECT_EQ(distances[0], 0);  // window-log has weight between 5 and 25 degrees
    EXPECT_GT(distances[1], 1);
    EXPECT_EQ(distances[1], distances[2]);
}

TEST(Reference, DoesNotDependOnTheOtherPairs) {
    const test::FunctionDatabase database({.theta_h = 9, .theta_d = 10, .phi_d = 40}, 40,
                                          test::random_sample);
    for (const auto* name : {"cwcbrt", "pawcielab"}) {
        std::vector<MaterialPair> all;
        for (std::uint32_t a = 0; a < 40; ++a) {
            for (std::uint32_t b = a + 1; b < 40; ++b) {
                all.emplace_back(a, b);
            }
        }
        const auto together = float64_distances(database, find_metric(name), all);
        for (std::size_t p = 0; p < all.size(); p += 37) {
            const MaterialPair one[] = {{all[p].second, all[p].first}};
            EXPECT_EQ(float64_distances(database, find_metric(name), one).front(), together[p]);
        }
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
