#include "engine/distance/parts/pair_tiles.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace merl::engine
