#include "engine/distance/parts/pair_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

namespace merl::engine {
namespace {

TEST(PairTiles, EveryPairHasOnePlace) {
    for (const std::uint32_t across : {1U, 2U, 7U}) {
        const PairTiles tiles = {.side = 3, .across = across};
        std::set<std::size_t> places;
        for (std::uint32_t i = 0; i < tiles.padded_materials(); ++i) {
            for (std::uint32_t j = i + 1; j < tiles.padded_materials(); ++j) {
                const auto at = tiles.sum_index(i, j);
                places.insert(at);
                const auto [row, column] =
                    tiles.place_of(static_cast<std::uint32_t>(at / tiles.pairs_of_tile()));
                EXPECT_EQ(row, i / 3 * 3);
                EXPECT_EQ(column, j / 3 * 3);
            }
        }
        const auto n = std::size_t{tiles.padded_materials()};
        EXPECT_EQ(places.size(), n * (n - 1) / 2);
        EXPECT_LT(*places.rbegin(), tiles.count() * tiles.pairs_of_tile());
    }
}

TEST(PairTiles, AreNotLargerThanADeviceCanKeep) {
    const auto& power = find_metric("cwcbrt");
    const auto& square = find_metric("pawcielab");
    for (const std::uint32_t materials : {2U, 7U, 100U, 1000U}) {
        for (const std::uint32_t side : {1U, 3U, 6U, 10U}) {
            const auto most = std::min(side, materials);
            EXPECT_LE(PairTiles::best(materials, power, {.power = side, .square = 10}).side, most);
            EXPECT_LE(PairTiles::best(materials, square, {.power = 10, .square = side}).side, most);
        }
    }
    EXPECT_EQ(PairTiles::best(100, square, {.power = 10, .square = 10}).side, 10U);
}

}  // namespace
}  // namespace merl::engine
