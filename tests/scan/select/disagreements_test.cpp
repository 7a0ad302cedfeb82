#include "scan/select/disagreements.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "scan/select/disagreement_search.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::make_distances;
using testing::plain_disagreements;
using testing::random_cases;

std::vector<Configuration> search_all(const Distances& distances) {
    std::vector<Configuration> found;
    DisagreementSearch search(distances);
    while (const auto next = search.next()) {
        found.push_back(*next);
    }
    return found;
}

TEST(Disagreements, SmallCaseByHand) {
    // ratios D1/D2: 0.25, 1, 4; all three configurations disagree
    const Distances distances = make_distances({1, 2, 4}, {4, 2, 1});
    const std::vector<Configuration> expected{{0, 2, 1.0 / 16}, {0, 1, 0.25}, {1, 2, 0.25}};
    EXPECT_EQ(all_disagreements(distances), expected);
    EXPECT_EQ(search_all(distances), expected);
}

TEST(Disagreements, NoneWhereThereIsNothingToCompare) {
    const Distances one_pair = make_distances({1}, {2});
    EXPECT_TRUE(all_disagreements(one_pair).empty());
    EXPECT_TRUE(search_all(one_pair).empty());
    EXPECT_TRUE(strongest_disagreements(one_pair, 5).empty());
}

TEST(Disagreements, NoneWhereMetricsAgree) {
    std::vector<double> values(190);
    for (std::size_t i = 0; i < values.size(); ++i) {
        values[i] = std::floor(static_cast<double>(i) / 3);  // zeros and ties, in both alike
    }
    const Distances distances = make_distances(values, values);
    EXPECT_TRUE(all_disagreements(distances).empty());
    EXPECT_TRUE(search_all(distances).empty());
}

TEST(Disagreements, ZeroDistances) {
    // (0,0), (0,2), (0,4), (3,0), (6,0), (1,1)
    const Distances distances = make_distances({0, 0, 0, 3, 6, 1}, {0, 2, 4, 0, 0, 1});
    const std::vector<Configuration> expected = plain_disagreements(distances);
    EXPECT_EQ(all_disagreements(distances), expected);
    EXPECT_EQ(search_all(distances), expected);
    // Tied at 0 in one metric: half the distance in the other.
    EXPECT_EQ(expected.back().agreement, 0.5);
}

TEST(Disagreements, ListAndSearchArePlainOrder) {
    for (const auto& random_case : random_cases()) {
        for (const std::uint32_t materials : {3U, 4U, 5U, 8U, 13U, 24U}) {
            for (std::uint64_t seed = 0; seed < 3; ++seed) {
                SCOPED_TRACE(random_case.name + ", " + std::to_string(materials) + " materials");
                const Distances distances = random_case.make(materials, seed);
                const std::vector<Configuration> expected = plain_disagreements(distances);
                ASSERT_EQ(all_disagreements(distances), expected);
                ASSERT_EQ(search_all(distances), expected);
            }
        }
    }
}

TEST(Disagreements, ListDoesNotDependOnThreads) {
    const Distances distances = random_cases()[1].make(40, 4);
    std::vector<Configuration> expected;
    testing::with_threads(1, [&] { expected = all_disagreements(distances); });
    for (const int threads : {2, 3, 8}) {
        testing::with_threads(threads, [&] { EXPECT_EQ(all_disagreements(distances), expected); });
    }
}

TEST(Disagreements, StrongestIsTheHeadOfTheList) {
    const Distances distances = random_cases()[1].make(20, 5);
    const std::vector<Configuration> all = plain_disagreements(distances);
    // Both sides of where searching gives way to listing, and more than there are.
    for (const std::size_t count : {0UL, 1UL, 100UL, 1000UL, 2000UL, all.size(), all.size() + 1,
                                    std::numeric_limits<std::size_t>::max()}) {
        const std::size_t expected = std::min(count, all.size());
        const std::vector<Configuration> found = strongest_disagreements(distances, count);
        ASSERT_EQ(found.size(), expected);
        EXPECT_TRUE(std::equal(found.begin(), found.end(), all.begin()));
    }
}

TEST(Disagreements, TooManyToListAreRefused) {
    // 300 materials in reverse order: 1.0e9 disagreements.
    std::vector<double> first(pair_count(300));
    std::vector<double> second(first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        first[i] = static_cast<double>(i + 1);
        second[i] = static_cast<double>(first.size() - i);
    }
    const Distances distances = make_distances(first, second);
    EXPECT_THROW(all_disagreements(distances), std::length_error);
    EXPECT_THROW(strongest_disagreements(distances, max_listed + 1), std::length_error);
    const std::vector<Configuration> few = strongest_disagreements(distances, 3);
    ASSERT_EQ(few.size(), 3U);
    EXPECT_EQ(few[0].left, 0U);
    EXPECT_EQ(few[0].right, distances.pairs() - 1);
}

TEST(Search, DroppedPairsAreGoneAndTheOrderStays) {
    for (const auto& random_case : random_cases()) {
        SCOPED_TRACE(random_case.name);
        const Distances distances = random_case.make(13, 6);
        std::vector<Configuration> expected;
        std::vector<Configuration> found;
        std::vector<bool> dropped(distances.pairs());
        DisagreementSearch search(distances);
        // After every fifth configuration its left pair goes, twice for good measure.
        for (const Configuration& next : plain_disagreements(distances)) {
            if (dropped[next.left] || dropped[next.right]) {
                continue;
            }
            expected.push_back(next);
            const auto got = search.next();
            ASSERT_TRUE(got.has_value());
            found.push_back(*got);
            if (expected.size() % 5 == 0) {
                dropped[next.left] = true;
                search.drop(next.left);
                search.drop(next.left);
            }
        }
        EXPECT_EQ(found, expected);
        EXPECT_FALSE(search.next().has_value());
    }
}

TEST(Search, NothingIsLeftWhenEveryPairIsDropped) {
    const Distances distances = random_cases()[0].make(5, 7);
    DisagreementSearch search(distances);
    for (std::uint32_t pair = 0; pair < distances.pairs(); ++pair) {
        search.drop(pair);
    }
    EXPECT_FALSE(search.next().has_value());
    EXPECT_FALSE(search.next().has_value());
}

TEST(Disagreements, ProgressMayEndListing) {
    const Distances distances = testing::random_cases()[0].make(60, 1);
    double last = 0;
    const auto all = all_disagreements(distances, [&](double share) {
        EXPECT_GE(share, last);
        EXPECT_LE(share, 1);
        last = share;
    });
    EXPECT_GE(last, 0.3);  // sorting may be done before it is asked
    EXPECT_EQ(all, all_disagreements(distances));
    const auto stop = [](double) { throw std::runtime_error("enough"); };
    EXPECT_THROW(all_disagreements(distances, stop), std::runtime_error);
    EXPECT_THROW(strongest_disagreements(distances, 5000, stop), std::runtime_error);
}

}  // namespace
}  // namespace merl::scan
