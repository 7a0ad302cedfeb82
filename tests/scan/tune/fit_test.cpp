#include "scan/tune/fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "tests/scan/tune/made_up_judges.h"

namespace merl::scan {
namespace {

using testing::MadeUpMaterials;

TEST(Fit, FindsTheParametersOfSimulatedJudges) {
    const MadeUpMaterials materials(20);
    const double slope = 1.7;
    for (const double weight : {0.03, 0.5, 2.0, 9.0}) {
        const auto judgements = materials.judged(weight, slope, 1'000'000);
        for (const double start : {0.0, 0.1, 10.0}) {
            const std::vector<TuneParameter> parameters = {{"weight", start, 0, 10}};
            const auto fit =
                fit_parameters(judgements.list, parameters, materials.distances_at(), {});
            EXPECT_NEAR(fit.values[0], weight, 0.01 * weight) << start;
            EXPECT_NEAR(fit.slope, slope, 0.01 * slope);
        }
    }
}

TEST(Fit, FindsThemOnEveryKindOfRange) {
    const MadeUpMaterials materials(20);
    const auto judgements = materials.judged(0.02, 2, 1'000'000);
    for (const auto& [low, high] : {std::pair{1e-9, 1.0}, std::pair{0.01, 0.05}, {-1.0, 0.5}}) {
        const std::vector<TuneParameter> parameters = {{"weight", high, low, high}};
        const auto fit = fit_parameters(judgements.list, parameters, materials.distances_at(), {});
        // The sign makes no difference.
        EXPECT_NEAR(std::abs(fit.values[0]), 0.02, 0.002) << low;
    }
}

TEST(Fit, StaysInTheRange) {
    const MadeUpMaterials materials(12);
    const auto judgements = materials.judged(3, 2, 1000);
    const std::vector<TuneParameter> parameters = {{"weight", 0.3, 0.1, 0.7}};
    const auto fit = fit_parameters(judgements.list, parameters,
                                    [&](std::span<const double> values) {
                                        EXPECT_GE(values[0], 0.1);
                                        EXPECT_LE(values[0], 0.7);
                                        return materials.distances(values[0]);
                                    },
                                    {});
    EXPECT_EQ(fit.values[0], 0.7);
}

TEST(Fit, TakesNoMoreEvaluationsThanAllowed) {
    const MadeUpMaterials materials(10);
    const auto judgements = materials.judged(3, 2, 1000);
    const std::vector<TuneParameter> parameters = {{"weight", 0.123456789, 0, 10}};
    for (const std::uint32_t most : {1U, 2U, 3U, 10U, 40U}) {
        std::uint32_t evaluations = 0;
        const auto fit = fit_parameters(judgements.list, parameters, materials.distances_at(),
                                        {.evaluations = most}, [&] { ++evaluations; });
        EXPECT_LE(evaluations, most);
        EXPECT_EQ(fit.evaluations, evaluations);
        if (most == 1) {
            EXPECT_EQ(fit.values[0], 0.123456789);  // as it was given
        }
    }
}

TEST(Fit, LeavesWhatPeopleOppose) {
    // Under 0 the distances say the opposite of what they say under 1.
    const MadeUpMaterials materials(12);
    const auto judgements = materials.judged(1, 2, 1000);
    const auto seen = materials.distances(1);
    const auto mixed = [&](std::span<const double> values) {
        std::vector<double> result;
        for (const double distance : seen) {
            result.push_back((1 - values[0]) / distance + values[0] * distance);
        }
        return result;
    };
    const std::vector<TuneParameter> parameters = {{"share", 0, 0, 1}};
    const auto fit = fit_parameters(judgements.list, parameters, mixed, {});
    EXPECT_GT(fit.slope, 1.9);
    EXPECT_GT(fit.values[0], 0.99);
}

TEST(Fit, StaysWhereNothingIsToBeGained) {
    const MadeUpMaterials materials(6);
    const auto judgements = materials.judged(1, 2, 10);
    const auto equal = [&](std::span<const double>) {
        return std::vector<double>(pair_count(6), 0.0);
    };
    const std::vector<TuneParameter> parameters = {{"nothing", 0.123456789, 0, 1}};
    const auto fit = fit_parameters(judgements.list, parameters, equal, {});
    EXPECT_EQ(fit.values[0], 0.123456789);
    EXPECT_EQ(fit.slope, 0);
}

TEST(Fit, IsTheSameForTheSameSeed) {
    const MadeUpMaterials materials(10);
    const auto judgements = materials.judged(3, 2, 10);
    const std::vector<TuneParameter> parameters = {{"weight", 0.1, 0, 10}};
    const auto trail = [&](std::uint64_t seed) {
        std::vector<double> tried;
        fit_parameters(judgements.list, parameters,
                       [&](std::span<const double> values) {
                           tried.push_back(values[0]);
                           return materials.distances(values[0]);
                       },
                       {.seed = seed});
        return tried;
    };
    EXPECT_EQ(trail(5), trail(5));
    EXPECT_NE(trail(5), trail(6));
}

TEST(Fit, PassesOnWhatIsThrown) {
    const MadeUpMaterials materials(6);
    const auto judgements = materials.judged(3, 2, 10);
    const std::vector<TuneParameter> parameters = {{"weight", 0.1, 0, 10}};
    int calls = 0;
    const auto fails = [&](std::span<const double> values) {
        if (++calls == 4) {
            throw std::runtime_error("four");
        }
        return materials.distances(values[0]);
    };
    EXPECT_THROW(fit_parameters(judgements.list, parameters, fails, {}), std::runtime_error);
    EXPECT_EQ(calls, 4);
    EXPECT_THROW(fit_parameters(judgements.list, parameters, materials.distances_at(), {},
                                [] { throw std::runtime_error("stop"); }),
                 std::runtime_error);
}

}  // namespace
}  // namespace merl::scan
