#include "scan/pairs/pairs.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>

#include "scan/pairs/bounded_count.h"
#include "scan/pairs/count.h"
#include "scan/select/disagreement_search.h"
#include "scan/select/disagreements.h"
#include "scan/select/scan_tables.h"
#include "scan/select/selection.h"
#include "scan/select/undecided.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::make_distances;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double infinity = std::numeric_limits<double>::infinity();

/// What `validate` complains about; empty when it does not.
std::string complaint(const Distances& distances) {
    try {
        distances.validate();
    } catch (const std::invalid_argument& error) {
        return error.what();
    }
    return "";
}

TEST(Pairs, NumbersOfTheThesis) {
    EXPECT_EQ(pair_count(100), 4950U);
    EXPECT_EQ(configuration_count(4950), 12'248'775U);
    EXPECT_EQ(pair_count(1000), 499'500U);
    EXPECT_EQ(configuration_count(499'500), 124'749'875'250U);
}

TEST(Pairs, NumbersAtTheLimits) {
    EXPECT_EQ(pair_count(0), 0U);
    EXPECT_EQ(pair_count(1), 0U);
    EXPECT_EQ(pair_count(2), 1U);
    EXPECT_EQ(configuration_count(1), 0U);
    EXPECT_EQ(pair_count(max_materials), 2'147'450'880U);
    EXPECT_EQ(configuration_count(2'147'450'880), 2'305'772'639'932'661'760U);
}

TEST(Pairs, IndexFollowsPairOrder) {
    for (const std::uint32_t materials : {2U, 3U, 4U, 13U, 100U, 401U}) {
        std::uint32_t index = 0;
        for (std::uint32_t i = 0; i < materials; ++i) {
            for (std::uint32_t j = i + 1; j < materials; ++j) {
                ASSERT_EQ(pair_index({i, j}, materials), index);
                ASSERT_EQ(pair_at(index, materials), (Pair{i, j}));
                ++index;
            }
        }
        EXPECT_EQ(index, pair_count(materials));
    }
}

TEST(Pairs, IndexIsExactForTheLargestNumberOfMaterials) {
    // Ends of rows are where the square root could be off by one.
    for (std::uint32_t row = 0; row + 1 < max_materials; ++row) {
        const Pair first{row, row + 1};
        const Pair last{row, max_materials - 1};
        ASSERT_EQ(pair_at(pair_index(first, max_materials), max_materials), first);
        ASSERT_EQ(pair_at(pair_index(last, max_materials), max_materials), last);
    }
    EXPECT_EQ(pair_index({max_materials - 2, max_materials - 1}, max_materials),
              pair_count(max_materials) - 1);
}

TEST(Distances, ValidOnesPass) {
    EXPECT_EQ(complaint(make_distances({0}, {0})), "");
    EXPECT_EQ(complaint(make_distances({0, 5e-324, 1.7e308}, {1, 1, 1})), "");
}

TEST(Distances, BadValueIsNamedWithItsPairAndMetric) {
    EXPECT_EQ(complaint(make_distances({1, nan, 1}, {1, 1, 1})),
              "the distance of 'm00000' and 'm00002' under one is nan: expected a finite number, "
              "zero or more");
    EXPECT_EQ(complaint(make_distances({1, 1, 1}, {1, 1, infinity})),
              "the distance of 'm00001' and 'm00002' under two is inf: expected a finite number, "
              "zero or more");
    EXPECT_EQ(complaint(make_distances({-0.25, 1, 1}, {1, 1, 1})),
              "the distance of 'm00000' and 'm00001' under one is -0.25: expected a finite number, "
              "zero or more");
}

TEST(Distances, SizesMustMatch) {
    EXPECT_EQ(complaint(make_distances({1, 1, 1}, {1, 1})),
              "2 distances under two: expected 3 for 3 materials");
    Distances four = make_distances({1, 1, 1}, {1, 1, 1});
    four.names.emplace_back("z");
    EXPECT_EQ(complaint(four), "3 distances under one: expected 6 for 4 materials");
}

TEST(Distances, BoundsAreNoneOrOneAPair) {
    Distances distances = make_distances({1, 1, 1}, {1, 1, 1});
    distances.first_bounds = {0, 5e-324, infinity};
    EXPECT_EQ(complaint(distances), "");
    distances.second_bounds = {0, 0};
    EXPECT_EQ(complaint(distances), "2 bounds under two: expected none or 3");
    distances.second_bounds = {0, -1e-9, 0};
    EXPECT_EQ(complaint(distances), "a bound under two is -1e-09: expected zero or more");
    distances.second_bounds = {};
    distances.first_bounds = {0, 0, nan};
    EXPECT_EQ(complaint(distances), "a bound under one is nan: expected zero or more");
    EXPECT_THROW(to_refine(distances, 1, 1), std::invalid_argument);
    EXPECT_THROW(count_undecided(distances), std::invalid_argument);
    EXPECT_THROW(write_pairs(-1, distances), std::invalid_argument);
}

TEST(Distances, AtLeastTwoMaterials) {
    Distances one;
    one.names = {"alone"};
    EXPECT_EQ(complaint(one), "1 materials: expected 2 to 65536");
    EXPECT_EQ(complaint(Distances{}), "0 materials: expected 2 to 65536");
}

TEST(Distances, NamesAscendBytewise) {
    Distances distances = make_distances({1, 1, 1}, {1, 1, 1});
    distances.names = {"chrome", "chrome-steel", "\xC3\xA9mail"};
    EXPECT_EQ(complaint(distances), "");
    distances.names = {"chrome-steel", "chrome", "steel"};
    EXPECT_EQ(complaint(distances),
              "material 'chrome-steel' is followed by 'chrome': expected distinct names in "
              "bytewise order");
    distances.names = {"chrome", "steel", "steel"};
    EXPECT_NE(complaint(distances), "");
}

TEST(Distances, EveryEntryPointValidates) {
    const Distances bad = make_distances({1, nan, 1}, {1, 1, 1});
    EXPECT_THROW(count_disagreements(bad), std::invalid_argument);
    EXPECT_THROW(count_by_streaming(bad), std::invalid_argument);
    EXPECT_THROW(count_by_inversions(bad), std::invalid_argument);
    EXPECT_THROW(all_disagreements(bad), std::invalid_argument);
    EXPECT_THROW(strongest_disagreements(bad, 1), std::invalid_argument);
    EXPECT_THROW(DisagreementSearch{bad}, std::invalid_argument);
    EXPECT_THROW(select_configurations(bad, 1, 1), std::invalid_argument);
    EXPECT_THROW(to_refine(bad, 1, 1), std::invalid_argument);
    EXPECT_THROW(count_undecided(bad), std::invalid_argument);
    EXPECT_THROW(write_pairs(-1, bad), std::invalid_argument);
    EXPECT_THROW(write_disagreements(-1, bad, {}), std::invalid_argument);
    EXPECT_THROW(write_selection(-1, bad, {}), std::invalid_argument);
}

}  // namespace
}  // namespace merl::scan
