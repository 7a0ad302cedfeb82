#include "engine/distance/parts/error_bound.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "engine/database/model_database.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "engine/distance/vulkan/vulkan_metric.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

/// Those that have a bound.
std::vector<const Metric*> all_metrics() {
    std::vector<const Metric*> all;
    for (const auto& metric : metrics()) {
        if (metric.has_degree()) {
            all.push_back(&metric);
        }
    }
    return all;
}

/// Every distance of a database, of the host and of shaders with and without float64, is within its
/// bound of the float64 twin's, under the metrics.
void expect_bounds_hold(const Database& database,
                        const std::vector<const Metric*>& chosen = {&find_metric("cosine-rmse"),
                                                                    &find_metric("cwcbrt"),
                                                                    &find_metric("pawcielab")}) {
    std::vector<Float64Request> requests;
    for (const auto* metric : chosen) {
        auto& request = requests.emplace_back(Float64Request{metric, {}});
        for (std::uint32_t i = 0; i < database.materials().size(); ++i) {
            for (std::uint32_t j = i + 1; j < database.materials().size(); ++j) {
                request.pairs.emplace_back(i, j);
            }
        }
    }
    const auto exact = float64_distances(database, requests);
    Engines without_float64(test::lavapipe_without_float64());
    for (auto* engines : {&test::host_engines(), &test::shader_engines(), &without_float64}) {
        const auto result = compute_distances(*engines, database, chosen);
        for (std::size_t m = 0; m < chosen.size(); ++m) {
            for (std::size_t p = 0; p < exact[m].size(); ++p) {
                const auto [i, j] = requests[m].pairs[p];
                // What the float64 twin itself may be off: some 1e-15 of the samples' norms.
                EXPECT_TRUE(std::isfinite(result.distances[m].bounds[p]));
                EXPECT_NEAR(result.distances[m].values[p], exact[m][p],
                            result.distances[m].bounds[p] + 1e-13 * exact[m][p])
                    << chosen[m]->name << " " << i << " " << j << ", "
                    << result.engines.front().engine.engine << ", grids of the "
                    << result.engines.front().engine.grids;
            }
        }
    }
}

TEST(ErrorBound, HoldsForRandomSamples) {
    expect_bounds_hold(test::FunctionDatabase({.theta_h = 17, .theta_d = 16, .phi_d = 19}, 13,
                                              test::random_sample),
                       all_metrics());
}

TEST(ErrorBound, HoldsForNearDuplicates) {
    // Materials that differ by 1e-2 down to 1e-16 of themselves, and an exact copy.
    expect_bounds_hold(test::FunctionDatabase(
        {.theta_h = 11, .theta_d = 12, .phi_d = 13}, 16,
        [](std::size_t m, std::uint64_t v, std::size_t c) {
            const double base = std::abs(test::random_sample(0, v, c));
            return m == 0 ? base : base * (1 + std::pow(10.0, -1.0 - static_cast<double>(m)));
        }));
}

TEST(ErrorBound, HoldsForHugeTinyAndBlackMaterials) {
    expect_bounds_hold(test::FunctionDatabase(
        {.theta_h = 11, .theta_d = 12, .phi_d = 13}, 10,
        [](std::size_t m, std::uint64_t v, std::size_t c) {
            const double sample = std::abs(test::random_sample(m, v, c));
            const double scales[] = {0, 0, 1e-30, 1e-20, 1e-8, 1e-4, 1, 1e6, 1e6, 1e8};
            return sample * scales[m];
        }));
}

void expect_golden_distances(Engines& engines) {
    // Against the independent float64 table, which has 14 to 15 digits.
    const auto database = open_model("abc");
    const Metric* const chosen[] = {&find_metric("cwcbrt"), &find_metric("pawcielab")};
    const auto result = compute_distances(engines, *database, chosen);
    std::ifstream file(MERL_GOLDEN_CSV);
    std::string line;
    std::getline(file, line);
    std::size_t p = 0;
    for (; std::getline(file, line); ++p) {
        std::istringstream fields(line);
        std::string field;
        std::getline(fields, field, ',');
        std::getline(fields, field, ',');
        for (const auto& d : result.distances) {
            std::getline(fields, field, ',');
            const double exact = std::stod(field);
            EXPECT_NEAR(d.values[p], exact, d.bounds[p]) << line;
            EXPECT_LT(d.bounds[p], 2e-4 * exact) << line;  // and is of use
        }
    }
    EXPECT_EQ(p, 4950U);
}

TEST(ErrorBound, HoldsForAllPairsOfTheBuiltInDatabase) {
    expect_golden_distances(test::host_engines());
}

TEST(ErrorBound, HoldsForAllPairsOfTheBuiltInDatabaseInShaders) {
    expect_golden_distances(test::shader_engines());
}

TEST(ErrorBound, HoldsForAllPairsOfTheBuiltInDatabaseWithoutFloat64InShaders) {
    Engines engines(test::lavapipe_without_float64());
    expect_golden_distances(engines);
}

TEST(ErrorBound, IsWiderWhereNumbersAreRoundedEitherWay) {
    const device::FloatControls nearest = {.float64 = true, .to_nearest = true};
    const device::FloatControls either = {.float64 = true};
    for (const auto* metric : all_metrics()) {
        const ErrorBound narrow(*metric, 1000, shader_roundings(nearest));
        const ErrorBound wide(*metric, 1000, shader_roundings(either));
        const ErrorBound::Sums sums = {.norm_a = 3, .norm_b = 5, .slopes = 7};
        EXPECT_GT(wide.distance(1, sums), 1.9 * narrow.distance(1, sums)) << metric->name;
    }
}

TEST(ErrorBound, IsUnknownWithoutADegree) {
    const test::FunctionDatabase database({.theta_h = 5, .theta_d = 5, .phi_d = 5}, 3,
                                          test::random_sample);
    const Metric* const one[] = {&framework_test_metrics()[0]};
    const auto result = compute_distances(test::host_engines(), database, one);
    for (const double bound : result.distances[0].bounds) {
        EXPECT_TRUE(std::isinf(bound));
    }
}

TEST(Reference, DoesNotDependOnWhichOtherPairsAreAsked) {
    const test::FunctionDatabase database({.theta_h = 17, .theta_d = 16, .phi_d = 19}, 40,
                                          test::random_sample);
    const auto& metric = find_metric("pawcielab");
    std::vector<MaterialPair> many;
    for (std::uint32_t j = 1; j < 40; ++j) {
        many.emplace_back(0, j);
    }
    const auto all = float64_distances(database, metric, many);
    const MaterialPair last[] = {many.back()};
    EXPECT_EQ(float64_distances(database, metric, last)[0], all.back());
}

}  // namespace
}  // namespace merl::engine
