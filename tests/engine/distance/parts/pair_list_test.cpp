#include "engine/distance/parts/pair_list.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <vector>

namespace merl::engine {
namespace {

using Pairs = std::vector<MaterialPair>;

/// In the order of each(), whose places count up.
Pairs pairs_of(const PairList& list) {
    Pairs pairs;
    list.each([&](std::size_t place, std::uint32_t first, std::uint32_t second) {
        EXPECT_EQ(place, pairs.size());
        pairs.emplace_back(first, second);
    });
    EXPECT_EQ(pairs.size(), list.size());
    return pairs;
}

TEST(PairList, HasAllPairsInTheirOrder) {
    EXPECT_EQ(pairs_of(PairList(4)), (Pairs{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}));
    EXPECT_EQ(PairList(65536).size(), std::size_t{65536} * 65535 / 2);
}

TEST(PairList, HasThoseThatAreListed) {
    for (const auto& listed : {Pairs{{0, 1}}, Pairs{{3, 4}}, Pairs{{0, 4}, {2, 3}, {2, 4}}}) {
        const PairList list(5, listed);
        EXPECT_EQ(pairs_of(list), listed);
        EXPECT_EQ(list.materials(), 5U);
        EXPECT_FALSE(list.is_all());
    }
}

TEST(PairList, KnowsWhatIsInAPair) {
    using Materials = std::vector<std::uint32_t>;
    const Pairs listed = {{0, 4}, {2, 4}};
    EXPECT_EQ(PairList(6, listed).paired(), (Materials{0, 2, 4}));
    EXPECT_EQ(PairList(3).paired(), (Materials{0, 1, 2}));
}

/// Every material that is in a pair is in one of few.
TEST(PairList, CoversItsMaterials) {
    EXPECT_EQ(PairList(4).covering(), (Pairs{{0, 1}, {2, 3}}));
    EXPECT_EQ(PairList(5).covering(), (Pairs{{0, 1}, {2, 3}, {0, 4}}));
    EXPECT_EQ(PairList(1).covering(), Pairs());
    EXPECT_EQ(PairList(1001).covering().size(), 501U);
    const Pairs star = {{0, 5}, {1, 5}, {2, 5}, {5, 6}};
    EXPECT_EQ(PairList(8, star).covering(), star);
    const Pairs path = {{0, 1}, {1, 2}, {2, 3}, {6, 7}};
    EXPECT_EQ(PairList(8, path).covering(), (Pairs{{0, 1}, {2, 3}, {6, 7}}));
}

TEST(PairList, OfAllIsAsGoodAsNone) {
    const Pairs all = {{0, 1}, {0, 2}, {1, 2}};
    const PairList list(3, all);
    EXPECT_TRUE(list.is_all());
    EXPECT_EQ(pairs_of(list), all);
}

TEST(PairList, HasARectangle) {
    const auto list = PairList::between(2, 3);
    EXPECT_EQ(pairs_of(list), (Pairs{{0, 2}, {0, 3}, {0, 4}, {1, 2}, {1, 3}, {1, 4}}));
    EXPECT_EQ(list.materials(), 5U);
    EXPECT_FALSE(list.is_all());
    EXPECT_EQ(list.paired().size(), 5U);
    EXPECT_EQ(pairs_of(PairList::between(1, 1)), (Pairs{{0, 1}}));
    EXPECT_THROW(PairList::between(0, 3), std::invalid_argument);
    EXPECT_THROW(PairList::between(3, 0), std::invalid_argument);
}

TEST(PairList, RefusesWhatIsNotInOrder) {
    for (const auto& listed : {Pairs{{1, 0}}, Pairs{{1, 1}}, Pairs{{0, 5}}, Pairs{{0, 1}, {0, 1}},
                               Pairs{{0, 2}, {0, 1}}, Pairs{{1, 2}, {0, 4}}, Pairs{{7, 9}}}) {
        EXPECT_THROW(PairList(5, listed), std::invalid_argument);
    }
}

}  // namespace
}  // namespace merl::engine
