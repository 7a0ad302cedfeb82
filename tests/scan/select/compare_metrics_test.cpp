#include "scan/select/compare_metrics.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>

#include "scan/io/input.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

DistanceTable make_table(std::vector<std::vector<double>> columns) {
    DistanceTable table;
    table.names = testing::make_distances(columns[0], columns[0]).names;
    for (auto& column : columns) {
        table.metrics.push_back({fmt::format("metric-{}", table.metrics.size()), column, {}});
    }
    return table;
}

std::optional<double> tau_b(std::vector<double> first, std::vector<double> second) {
    return compare_metrics(make_table({std::move(first), std::move(second)}), 0)
        .comparisons.at(0)
        .tau_b;
}

std::string written(const DistanceTable& table, const std::vector<Comparison>& comparisons) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    write_comparisons(::fileno(file.get()), table, comparisons);
    std::string text(static_cast<std::size_t>(::lseek(::fileno(file.get()), 0, SEEK_END)), '\0');
    EXPECT_EQ(::pread(::fileno(file.get()), text.data(), text.size(), 0),
              static_cast<ssize_t>(text.size()));
    return text;
}

// Expected values by scipy.stats.kendalltau of SciPy 1.10.1.

TEST(KendallTauB, AgreesWithScipyOnTies) {
    EXPECT_NEAR(*tau_b({1, 2, 2, 3, 5, 5, 5, 8, 9, 9}, {3, 1, 1, 4, 4, 6, 6, 2, 9, 9}),
                0.6173309979059936, 1e-15);
    EXPECT_NEAR(*tau_b({0, 0, 0, 1, 0, 2}, {1, 2, 2, 2, 0, 2}), 0.4444444444444444, 1e-15);
    std::vector<double> first;
    std::vector<double> second;
    for (int k = 0; k < 45; ++k) {
        const int p = (k * 7919 + 13) % 10;
        first.push_back(p);
        second.push_back((p * 3 + (k * 104729 + 5) % 7) / 4);
    }
    EXPECT_NEAR(*tau_b(first, second), 0.9149845193260275, 1e-15);
}

TEST(KendallTauB, AgreesWithScipyOnTheBuiltInDatabase) {
    const auto table = parse_distance_table(read_input(MERL_GOLDEN_CSV), MERL_GOLDEN_CSV);
    const auto result = compare_metrics(table, 5);
    EXPECT_TRUE(result.streamed);
    const Comparison& c = result.comparisons.at(0);
    EXPECT_NEAR(*c.tau_b, 0.2995647319834024, 1e-15);
    EXPECT_EQ(c.counts.disagreements(), 4'289'737U);
    EXPECT_EQ(c.undecided, 0U);
}

TEST(KendallTauB, TheLimits) {
    EXPECT_EQ(tau_b({1, 2, 3}, {10, 20, 30}), 1);
    EXPECT_EQ(tau_b({1, 2, 3}, {3, 2, 1}), -1);
    EXPECT_EQ(tau_b({1, 1, 1}, {1, 2, 3}), std::nullopt);
    EXPECT_EQ(tau_b({1, 2, 3}, {0, 0, 0}), std::nullopt);
    EXPECT_EQ(tau_b({1}, {2}), std::nullopt);  // one pair, no configuration
    Counts counts;
    counts.configurations = configuration_count(pair_count(max_materials));  // about 2^61
    EXPECT_NEAR(*kendall_tau_b(counts), 1, 1e-15);
}

TEST(CompareMetrics, EveryTwoInOrderWithCountsAndStrongest) {
    for (const auto& [name, make] : testing::random_cases()) {
        SCOPED_TRACE(name);
        const Distances one = make(12, 1);
        const Distances two = make(12, 2);
        auto table = make_table({one.first, one.second, two.first});
        table.names = one.names;
        const auto result = compare_metrics(table, 5);
        ASSERT_EQ(result.comparisons.size(), 3U);
        std::size_t i = 0;
        for (const auto& [first, second] : {std::pair{0U, 1U}, {0U, 2U}, {1U, 2U}}) {
            const Comparison& c = result.comparisons[i++];
            EXPECT_EQ(c.first, first);
            EXPECT_EQ(c.second, second);
            const Distances d = DistanceTable(table).distances(first, second);
            const auto all = testing::plain_disagreements(d);
            EXPECT_EQ(c.counts.disagreements(), all.size());
            EXPECT_EQ(c.strongest, testing::plain_selection(d, all, 5, 1));
        }
    }
}

TEST(CompareMetrics, DoesNotDependOnThreads) {
    const auto& make = testing::random_cases().front().make;
    const auto table = make_table({make(40, 1).first, make(40, 2).first, make(40, 3).first});
    std::string one;
    std::string four;
    const auto text = [&] { return written(table, compare_metrics(table, 5).comparisons); };
    testing::with_threads(1, [&] { one = text(); });
    testing::with_threads(4, [&] { four = text(); });
    EXPECT_EQ(one, four);
}

TEST(CompareMetrics, CountsWhatBoundsLeaveOpen) {
    auto table = make_table({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}});
    table.metrics[0].bounds = {0.6, 0.6, 0};
    table.metrics[1].bounds = {0, 0, 0};
    table.metrics[2].bounds = {kInfinity, 0, 0};
    const auto result = compare_metrics(table, 1).comparisons;
    EXPECT_EQ(result[0].undecided, 1U);
    EXPECT_EQ(result[1].undecided, std::nullopt);
    EXPECT_EQ(result[2].undecided, std::nullopt);
}

TEST(CompareMetrics, WhatProgressThrowsComesOut) {
    const auto table = make_table({{1, 2, 3}, {1, 3, 2}, {3, 2, 1}});
    EXPECT_THROW(compare_metrics(table, 1, [](double) { throw std::runtime_error("stop"); }),
                 std::runtime_error);
    double last = 0;
    int calls = 0;
    compare_metrics(table, 1, [&](double share) {
        EXPECT_GE(share, last);
        last = share;
        ++calls;
    });
    EXPECT_EQ(last, 1);
    EXPECT_GT(calls, 3 * 3);  // within each comparison, too
}

TEST(WriteComparisons, QuotesAndLeavesEmptyWhatThereIsNot) {
    DistanceTable table = {{"a", "b", "c,1"},
                           {{"x", {1, 2, 3}, {}}, {"y,z", {3, 2, 1}, {}}, {"w", {1, 1, 1}, {}}}};
    EXPECT_EQ(written(table, compare_metrics(table, 1).comparisons),
              "metric_1,metric_2,configurations,disagreements,rate,tau_b,concordant,discordant,"
              "tied_in_first_only,tied_in_second_only,tied_in_both,undecided,left_1,left_2,right_1,"
              "right_2,agreement\n"
              "x,\"y,z\",3,3,1,-1,0,3,0,0,0,0,a,b,b,\"c,1\",0.1111111111111111\n"
              "x,w,3,3,1,,0,0,0,3,0,0,a,b,b,\"c,1\",0.3333333333333333\n"
              "\"y,z\",w,3,3,1,,0,0,0,3,0,0,b,\"c,1\",a,b,0.3333333333333333\n");
}

}  // namespace
}  // namespace merl::scan
