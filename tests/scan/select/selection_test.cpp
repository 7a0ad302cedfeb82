#include "scan/select/selection.h"

#include <gtest/gtest.h>

#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::make_distances;
using testing::plain_disagreements;
using testing::plain_selection;
using testing::random_cases;

TEST(Selection, IsTheGreedyOneOverTheFullSort) {
    for (const auto& random_case : random_cases()) {
        for (const std::uint32_t materials : {3U, 4U, 6U, 13U, 22U}) {
            const Distances distances = random_case.make(materials, materials);
            const std::vector<Configuration> all = plain_disagreements(distances);
            for (const std::uint32_t per_material : {1U, 2U, 10U, 1000U}) {
                for (const std::uint32_t select : {1U, 7U, 100U}) {
                    SCOPED_TRACE(random_case.name + ", " + std::to_string(materials) +
                                 " materials, " + std::to_string(per_material) + " each, select " +
                                 std::to_string(select));
                    ASSERT_EQ(select_configurations(distances, select, per_material),
                              plain_selection(distances, all, select, per_material));
                }
            }
        }
    }
}

TEST(Selection, AMaterialInBothPairsTakesPartOnce) {
    // Three materials: every configuration has one of them in both pairs. All three disagree.
    const Distances distances = make_distances({1, 2, 4}, {4, 2, 1});
    EXPECT_EQ(select_configurations(distances, 100, 1).size(), 1U);
    EXPECT_EQ(select_configurations(distances, 100, 2).size(), 2U);
    EXPECT_EQ(select_configurations(distances, 100, 3).size(), 3U);
}

TEST(Selection, EqualAgreementFollowsPairOrder) {
    // All six pairs tie in the first metric; in the second, equal steps of a factor of two.
    const Distances distances = make_distances({1, 1, 1, 1, 1, 1}, {2, 1, 2, 1, 2, 1});
    const auto chosen = select_configurations(distances, 3, 100);
    const std::vector<Configuration> expected{{0, 1, 0.5}, {0, 3, 0.5}, {0, 5, 0.5}};
    EXPECT_EQ(chosen, expected);
}

TEST(Selection, LimitsOfZeroChooseNothing) {
    const Distances distances = make_distances({1, 2, 4}, {4, 2, 1});
    EXPECT_TRUE(select_configurations(distances, 0, 10).empty());
    EXPECT_TRUE(select_configurations(distances, 10, 0).empty());
}

TEST(Selection, TwoMaterialsHaveNothingToChoose) {
    EXPECT_TRUE(select_configurations(make_distances({1}, {1}), 100, 10).empty());
}

}  // namespace
}  // namespace merl::scan
