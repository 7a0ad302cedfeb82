#include "engine/distance/parts/pair_tiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <vector>

namespace merl::engine {
namespace {

TEST(PairTiles, EveryPairHasOnePlace) {
    for (const std::uint32_t across : {1U, 2U, 7U}) {
        const PairList pairs(3 * across);
        const auto tiles = PairTiles::covering(pairs, 3);
        ASSERT_EQ(tiles.across, across);
        std::set<std::size_t> places;
        pairs.each([&](std::size_t pair, std::uint32_t i, std::uint32_t j) {
            const auto at = tiles.sum_index(pair, i, j);
            places.insert(at);
            const auto [row, column] = tiles.place_of(at / tiles.pairs_of_tile());
            EXPECT_EQ(row, i / 3 * 3);
            EXPECT_EQ(column, j / 3 * 3);
        });
        const auto n = std::size_t{tiles.padded_materials()};
        EXPECT_EQ(places.size(), n * (n - 1) / 2);
        EXPECT_LT(*places.rbegin(), tiles.count() * tiles.pairs_of_tile());
    }
}

TEST(PairTiles, EveryPairOfARectangleHasOnePlace) {
    for (const std::uint32_t rows : {1U, 3U, 7U, 20U}) {
        for (const std::uint32_t columns : {1U, 4U, 9U}) {
            const auto pairs = PairList::between(rows, columns);
            const auto tiles = PairTiles::covering(pairs, 3);
            EXPECT_EQ(tiles.on_diagonal(), 0U);
            std::set<std::size_t> places;
            pairs.each([&](std::size_t pair, std::uint32_t i, std::uint32_t j) {
                const auto at = tiles.sum_index(pair, i, j);
                places.insert(at);
                const auto [row, column] = tiles.place_of(at / tiles.pairs_of_tile());
                EXPECT_EQ(at % tiles.pairs_of_tile(), (i - row) * 3 + j - column);
            });
            EXPECT_EQ(places.size(), pairs.size());
            for (std::uint64_t tile = 0; tile < tiles.count(); ++tile) {
                const auto [row, column] = tiles.place_of(tile);
                EXPECT_LE(row + 3, tiles.padded_materials());
                EXPECT_LE(column + 3, tiles.padded_materials());
            }
            EXPECT_LT(*places.rbegin(), tiles.count() * tiles.pairs_of_tile());
        }
    }
}

TEST(PairTiles, ListedPairsAreTilesOfTheirOwn) {
    const std::vector<MaterialPair> list = {{0, 4}, {2, 3}, {2, 6}};
    const PairList pairs(1000, list);
    for (const auto& tiles :
         {PairTiles::covering(pairs, 20), PairTiles::best(pairs, find_metric("pawcielab"), {})}) {
        EXPECT_EQ(tiles.count() * tiles.pairs_of_tile(), 3U);
        EXPECT_EQ(tiles.on_diagonal(), 0U);
        EXPECT_EQ(tiles.padded_materials(), 1000U);
        pairs.each([&](std::size_t pair, std::uint32_t i, std::uint32_t j) {
            const auto [row, column] = tiles.place_of(tiles.sum_index(pair, i, j));
            EXPECT_EQ(row, i);
            EXPECT_EQ(column, j);
        });
    }
}

TEST(PairTiles, AreNotLargerThanADeviceCanKeep) {
    const auto& power = find_metric("cwcbrt");
    const auto& square = find_metric("pawcielab");
    for (const std::uint32_t materials : {2U, 7U, 100U, 1000U}) {
        const PairList pairs(materials);
        for (const std::uint32_t side : {1U, 3U, 6U, 10U}) {
            const auto most = std::min(side, materials);
            EXPECT_LE(PairTiles::best(pairs, power, {.power = side, .square = 10}).side, most);
            EXPECT_LE(PairTiles::best(pairs, square, {.power = 10, .square = side}).side, most);
        }
    }
    EXPECT_EQ(PairTiles::best(PairList(100), square, {.power = 10, .square = 10}).side, 10U);
}

}  // namespace
}  // namespace merl::engine
