// Decisions between materials that are nearly the same, against a plain program.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "app/pipeline/refine.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "engine/distance/parts/slab.h"
#include "scan/pairs/count.h"
#include "scan/select/selection.h"
#include "scan/select/undecided.h"
#include "tests/engine/support.h"

namespace merl::pipeline {
namespace {

constexpr engine::Grid kGrid = {.theta_h = 2, .theta_d = 2, .phi_d = 3};
constexpr std::uint32_t kSelect = 100;
constexpr std::uint32_t kPerMaterial = 10;

/// Blends of two materials in 50 groups of so many: the weights of a group are 1e-12 to 1e-16
/// apart.
test::FunctionDatabase near_equal_blends(std::size_t materials) {
    return test::FunctionDatabase(
        kGrid, materials, [=](std::size_t m, std::uint64_t voxel, std::size_t channel) {
            const double a = std::abs(test::random_sample(0, voxel, channel));
            const double b = std::abs(test::random_sample(1, voxel, channel));
            const std::size_t within = m / 50;
            const double apart = static_cast<double>(1 + within) *
                                 std::pow(10.0, -12 - static_cast<double>(within % 5));
            const double weight = static_cast<double>(m % 50) / 50 + apart;
            return (1 - weight) * a + weight * b;
        });
}

/// All distances in long double, pair by pair and sample by sample.
std::vector<double> plain_distances(const engine::Database& database,
                                    const engine::Metric& metric) {
    const engine::Domain domain(kGrid);
    const engine::VoxelList list(domain, engine::VoxelSet::above_horizon);
    const engine::Slab slab(domain, list, 0, list.size());
    engine::BlockWeights weights = {};
    engine::weigh_block(metric, slab, 0, weights);
    std::vector<engine::BlockSamples> samples(database.materials().size());
    for (std::size_t m = 0; m < samples.size(); ++m) {
        std::vector<engine::BlockSamples> read(1);
        engine::read_blocks(database, m, {0, kGrid.voxels()}, slab.runs, read);
        metric.twin.transform(metric.parameters, slab.voxels_of_block(0), read[0], samples[m]);
    }
    std::vector<double> distances;
    for (std::size_t a = 0; a < samples.size(); ++a) {
        for (std::size_t b = a + 1; b < samples.size(); ++b) {
            long double sum = 0;
            for (std::size_t channel = 0; channel < 3; ++channel) {
                for (std::size_t k = 0; k < list.size(); ++k) {
                    const auto d = static_cast<long double>(samples[a][channel][k]) -
                                   static_cast<long double>(samples[b][channel][k]);
                    const auto root = std::cbrt(std::abs(d));
                    sum += weights[k] * (metric.header.degree < 1 ? root * root : d * d);
                }
            }
            distances.push_back(
                static_cast<double>(std::sqrt(sum / static_cast<long double>(kGrid.voxels()))));
        }
    }
    return distances;
}

/// Configurations whose two distances are nearer to each other than the errors of two float64
/// programs.
std::uint64_t count_near(std::vector<double> distances) {
    std::ranges::sort(distances);
    std::uint64_t near = 0;
    std::size_t end = 0;
    for (std::size_t i = 0; i < distances.size(); ++i) {
        end = std::max(end, i + 1);
        while (end < distances.size() && distances[end] <= distances[i] * (1 + 3e-14)) {
            ++end;
        }
        near += end - i - 1;
    }
    return near;
}

TEST(Exact, ThousandNearEqualBlendsHaveTheCountAndSelectionOfAPlainProgram) {
    const auto database = near_equal_blends(1000);
    const std::array metrics = {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")};
    engine::Engines engines({.device = engine::kHost});
    auto computed = engine::compute_distances(engines, database, metrics);
    scan::Distances refined = {.names = database.materials(),
                               .first_metric = metrics[0]->name,
                               .second_metric = metrics[1]->name,
                               .first = std::move(computed.distances[0].values),
                               .second = std::move(computed.distances[1].values),
                               .first_bounds = std::move(computed.distances[0].bounds),
                               .second_bounds = std::move(computed.distances[1].bounds)};
    const auto took = refine(refined, database, metrics, kSelect, kPerMaterial, 1ULL << 30U, {});
    EXPECT_GT(took.first + took.second, 100'000U);
    EXPECT_TRUE(scan::to_refine(refined, kSelect, kPerMaterial).empty());

    // All distances in float64, not only those that were open.
    std::vector<engine::MaterialPair> pairs;
    for (std::uint32_t a = 0; a < 1000; ++a) {
        for (std::uint32_t b = a + 1; b < 1000; ++b) {
            pairs.emplace_back(a, b);
        }
    }
    scan::Distances exact = refined;
    exact.first = engine::float64_distances(database, *metrics[0], pairs);
    exact.second = engine::float64_distances(database, *metrics[1], pairs);
    EXPECT_EQ(scan::count_by_inversions(refined).disagreements(),
              scan::count_by_inversions(exact).disagreements());
    EXPECT_EQ(scan::select_configurations(refined, kSelect, kPerMaterial),
              scan::select_configurations(exact, kSelect, kPerMaterial));

    // And those are the plain program's, but for what is next to a tie.
    scan::Distances plain = exact;
    plain.first = plain_distances(database, *metrics[0]);
    plain.second = plain_distances(database, *metrics[1]);
    for (std::size_t p = 0; p < pairs.size(); ++p) {
        ASSERT_NEAR(exact.first[p], plain.first[p], 1e-14 * plain.first[p]) << p;
        ASSERT_NEAR(exact.second[p], plain.second[p], 1e-14 * plain.second[p]) << p;
    }
    const auto found = scan::count_by_inversions(exact).disagreements();
    const auto expected = scan::count_by_inversions(plain).disagreements();
    const auto near = count_near(plain.first) + count_near(plain.second);
    EXPECT_LE(std::max(found, expected) - std::min(found, expected), near);
    EXPECT_LT(near, plain.configurations() / 500);  // a check of next to nothing otherwise
}

}  // namespace
}  // namespace merl::pipeline
