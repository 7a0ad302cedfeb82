#include "scan/select/pair_tree.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>

#include "tests/scan/support.h"

namespace merl::scan {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr std::uint32_t no_pair = std::numeric_limits<std::uint32_t>::max();

std::vector<PairPlace> random_places(std::uint32_t pairs) {
    std::mt19937_64 random(pairs);
    std::lognormal_distribution<double> draw;
    std::vector<PairPlace> places;
    for (std::uint32_t pair = 0; pair < pairs; ++pair) {
        const double first = random() % 4 == 0 ? 0 : draw(random);
        const double second = draw(random);
        places.push_back({first, first * (random() % 2 == 0 ? 1 : 1.5), second, second * 1.25});
    }
    return places;
}

/// Checks a node and those below it; returns the pairs that are there.
std::vector<std::uint32_t> check(const PairTree& tree, const std::vector<PairPlace>& places,
                                 const std::vector<bool>& dropped, std::uint32_t node) {
    std::vector<std::uint32_t> pairs;
    const auto [box, earliest] = tree.box(node);
    if (tree.is_leaf(node)) {
        if (earliest != no_pair) {
            pairs.push_back(earliest);
        }
    } else {
        const std::uint32_t left = PairTree::left(node);
        const std::uint32_t right = PairTree::right(node);
        EXPECT_EQ(tree.leaves(left) + tree.leaves(right), tree.leaves(node));
        for (const auto child : {left, right}) {
            EXPECT_GE(tree.leaves(child), tree.leaves(node) / 2);
            std::ranges::copy(check(tree, places, dropped, child), std::back_inserter(pairs));
        }
    }
    PairPlace expected = {infinity, -infinity, infinity, -infinity};
    for (const auto pair : pairs) {
        EXPECT_FALSE(dropped[pair]);
        expected.least_first = std::min(expected.least_first, places[pair].least_first);
        expected.greatest_first = std::max(expected.greatest_first, places[pair].greatest_first);
        expected.least_second = std::min(expected.least_second, places[pair].least_second);
        expected.greatest_second = std::max(expected.greatest_second, places[pair].greatest_second);
    }
    EXPECT_EQ(earliest, pairs.empty() ? no_pair : *std::ranges::min_element(pairs));
    EXPECT_EQ(box.least_first, expected.least_first);
    EXPECT_EQ(box.greatest_first, expected.greatest_first);
    EXPECT_EQ(box.least_second, expected.least_second);
    EXPECT_EQ(box.greatest_second, expected.greatest_second);
    return pairs;
}

TEST(PairTree, BoxesHaveTheirPairs) {
    for (const std::uint32_t pairs : {1U, 2U, 3U, 5U, 7U, 8U, 9U, 15U, 16U, 17U, 31U, 63U, 64U, 65U,
                                      127U, 257U, 1000U, 40'000U}) {
        SCOPED_TRACE(pairs);
        const auto places = random_places(pairs);
        PairTree tree(pairs, [&](std::uint32_t pair) { return places[pair]; });
        EXPECT_EQ(tree.leaves(PairTree::root), pairs);
        std::vector<bool> dropped(pairs);
        EXPECT_EQ(check(tree, places, dropped, PairTree::root).size(), pairs);
        std::mt19937_64 random(1);
        std::uint32_t left = pairs;
        for (std::uint32_t i = 0; i < pairs; ++i) {
            const auto pair = static_cast<std::uint32_t>(random() % pairs);
            left -= dropped[pair] ? 0 : 1;
            dropped[pair] = true;
            tree.drop(pair);
        }
        EXPECT_EQ(check(tree, places, dropped, PairTree::root).size(), left);
    }
}

TEST(PairTree, NoNodeOfTheLargestTreeIsEmpty) {
    // Only the arithmetic: a node's number and its leaves, down to one of them.
    const auto pairs = static_cast<std::uint32_t>(pair_count(200));
    const PairTree tree(pairs, [](std::uint32_t pair) {
        const double value = pair;
        return PairPlace{value, value, value, value};
    });
    for (std::uint32_t node = PairTree::root; !tree.is_leaf(node);
         node = PairTree::right(PairTree::left(node))) {
        ASSERT_GT(tree.leaves(PairTree::left(node)), 0U);
        ASSERT_GT(tree.leaves(PairTree::right(node)), 0U);
        if (tree.is_leaf(PairTree::left(node))) {
            break;
        }
    }
}

}  // namespace
}  // namespace merl::scan
