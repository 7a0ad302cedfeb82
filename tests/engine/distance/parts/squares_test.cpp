#include "engine/distance/parts/squares.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "tests/engine/support.h"

namespace merl::engine {
namespace {

TEST(Squares, HaveEveryPairOnce) {
    for (const std::uint32_t materials : {1U, 2U, 7U, 12U}) {
        for (const std::uint32_t side : {1U, 3U, 4U, 20U}) {
            const Squares squares = {.materials = materials, .side = side};
            std::set<std::pair<std::uint32_t, std::uint32_t>> seen;
            std::uint64_t pairs = 0;
            for (std::uint64_t number = 0; number < squares.count(); ++number) {
                const auto at = squares.at(number);
                pairs += at.pairs();
                EXPECT_EQ(squares.number_of(at.row / side, at.column / side), number);
                for (std::uint32_t r = 0; r < at.rows; ++r) {
                    for (std::uint32_t c = at.is_diagonal() ? r + 1 : 0; c < at.columns; ++c) {
                        EXPECT_TRUE(seen.emplace(at.row + r, at.column + c).second);
                        EXPECT_LT(at.row + r, at.column + c);
                        EXPECT_LT(at.column + c, materials);
                    }
                }
            }
            EXPECT_EQ(seen.size(), std::size_t{materials} * (materials - 1) / 2);
            EXPECT_EQ(pairs, seen.size());
        }
    }
}

TEST(Squares, HaveTheMaterialsOfRowsAndColumns) {
    using Names = std::vector<std::string>;
    const test::FunctionDatabase database({.theta_h = 6, .theta_d = 5, .phi_d = 4}, 7,
                                          test::random_sample);
    const Squares squares = {.materials = 7, .side = 3};
    const auto last = squares.at(2);
    EXPECT_EQ(last, (Rectangle{.row = 0, .rows = 3, .column = 6, .columns = 1}));
    EXPECT_EQ(rows_of(last), 3U);
    EXPECT_EQ(materials_of(database, last)->materials(),
              (Names{"material-0000", "material-0001", "material-0002", "material-0006"}));
    const auto diagonal = squares.at(3);
    EXPECT_EQ(rows_of(diagonal), 0U);
    EXPECT_EQ(materials_of(database, diagonal)->materials(),
              (Names{"material-0003", "material-0004", "material-0005"}));
}

}  // namespace
}  // namespace merl::engine
