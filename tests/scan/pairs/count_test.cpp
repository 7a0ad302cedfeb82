#include "scan/pairs/count.h"

#include <gtest/gtest.h>

#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::make_distances;
using testing::random_cases;

/// The classes by their definition.
Counts plain_count(const Distances& d) {
    Counts counts;
    for (std::uint32_t a = 0; a < d.pairs(); ++a) {
        for (std::uint32_t b = a + 1; b < d.pairs(); ++b) {
            const bool tied_1 = d.first[a] == d.first[b];
            const bool tied_2 = d.second[a] == d.second[b];
            ++counts.configurations;
            if (tied_1 && tied_2) {
                ++counts.tied_both;
            } else if (tied_1) {
                ++counts.tied_first_only;
            } else if (tied_2) {
                ++counts.tied_second_only;
            } else if ((d.first[a] < d.first[b]) != (d.second[a] < d.second[b])) {
                ++counts.discordant;
            }
        }
    }
    return counts;
}

TEST(Count, EachClassOnce) {
    // Pairs 0 to 5; against pair 0: discordant, tied first, tied second, tied both, concordant.
    const Distances distances = make_distances({5, 6, 5, 7, 5, 8}, {5, 4, 6, 5, 5, 8});
    const Counts counts = count_by_inversions(distances);
    EXPECT_EQ(counts, plain_count(distances));
    EXPECT_EQ(counts.configurations, 15U);
    EXPECT_EQ(counts.tied_both, 1U);
    EXPECT_EQ(counts.disagreements() + counts.concordant() + counts.tied_both, 15U);
}

TEST(Count, OnePairHasNoConfiguration) {
    const Distances distances = make_distances({1}, {2});
    EXPECT_EQ(count_by_streaming(distances), Counts{});
    EXPECT_EQ(count_by_inversions(distances), Counts{});
}

TEST(Count, ThreeMaterials) {
    const Distances reversed = make_distances({1, 2, 3}, {3, 2, 1});
    EXPECT_EQ(count_by_streaming(reversed), (Counts{3, 3, 0, 0, 0}));
    EXPECT_EQ(count_by_inversions(reversed), (Counts{3, 3, 0, 0, 0}));
    const Distances same = make_distances({1, 2, 3}, {1, 2, 3});
    EXPECT_EQ(count_by_streaming(same), (Counts{3, 0, 0, 0, 0}));
    EXPECT_EQ(count_by_inversions(same), (Counts{3, 0, 0, 0, 0}));
}

TEST(Count, AllTied) {
    const std::vector<double> equal(10, 0.5);
    const std::vector<double> zero(10, 0);
    const Distances tied_both = make_distances(equal, zero);
    EXPECT_EQ(count_by_streaming(tied_both), (Counts{45, 0, 0, 0, 45}));
    EXPECT_EQ(count_by_inversions(tied_both), (Counts{45, 0, 0, 0, 45}));
    const Distances tied_first = make_distances(equal, {9, 8, 7, 6, 5, 4, 3, 2, 1, 0});
    EXPECT_EQ(count_by_streaming(tied_first), (Counts{45, 0, 45, 0, 0}));
    EXPECT_EQ(count_by_inversions(tied_first), (Counts{45, 0, 45, 0, 0}));
    const Distances tied_second = make_distances({9, 8, 7, 6, 5, 4, 3, 2, 1, 0}, equal);
    EXPECT_EQ(count_by_streaming(tied_second), (Counts{45, 0, 0, 45, 0}));
    EXPECT_EQ(count_by_inversions(tied_second), (Counts{45, 0, 0, 45, 0}));
}

TEST(Count, ZeroHasNoSign) {
    const Distances distances = make_distances({0.0, -0.0, 1}, {-0.0, 0.0, 1});
    EXPECT_EQ(count_by_streaming(distances), (Counts{3, 0, 0, 0, 1}));
    EXPECT_EQ(count_by_inversions(distances), (Counts{3, 0, 0, 0, 1}));
}

TEST(Count, BothWaysAreTheDefinition) {
    for (const auto& random_case : random_cases()) {
        for (const std::uint32_t materials : {2U, 3U, 4U, 5U, 7U, 13U, 20U, 31U}) {
            SCOPED_TRACE(random_case.name + ", " + std::to_string(materials) + " materials");
            const Distances distances = random_case.make(materials, materials);
            const Counts expected = plain_count(distances);
            EXPECT_EQ(count_by_streaming(distances), expected);
            EXPECT_EQ(count_by_inversions(distances), expected);
        }
    }
}

TEST(Count, DoesNotDependOnThreads) {
    for (const auto& random_case : random_cases()) {
        const Distances distances = random_case.make(60, 1);
        const Counts expected = count_by_inversions(distances);
        for (const int threads : {1, 2, 3, 8}) {
            testing::with_threads(
                threads, [&] { EXPECT_EQ(count_by_streaming(distances), expected) << threads; });
        }
    }
}

TEST(Count, CensusSaysWhichWayItTook) {
    const Census few = count_disagreements(make_distances({1, 2, 3}, {3, 2, 1}));
    EXPECT_TRUE(few.streamed);
    EXPECT_EQ(few.counts.disagreements(), 3U);

    // 449 materials are 5.06e9 configurations.
    std::vector<double> first(pair_count(449));
    std::vector<double> second(first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
        first[i] = static_cast<double>(i);
        second[i] = static_cast<double>(first.size() - i);
    }
    const Distances many = make_distances(first, second);
    ASSERT_GT(many.configurations(), max_streamed);
    const Census census = count_disagreements(many);
    EXPECT_FALSE(census.streamed);
    EXPECT_EQ(census.counts.discordant, many.configurations());
}

}  // namespace
}  // namespace merl::scan
