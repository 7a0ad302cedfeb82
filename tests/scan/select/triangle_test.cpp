#include "scan/select/triangle.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <random>
#include <stdexcept>

#include "tests/scan/support.h"

namespace merl::scan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr std::array<std::size_t, 1> kFirst = {0};

DistanceTable make_table(const std::vector<double>& values) {
    return {testing::make_distances(values, values).names, {{"metric", values, {}}}};
}

/// The distances f(|x - y|) of places on a line.
template <typename Function>
std::vector<double> on_a_line(const std::vector<double>& places, Function f) {
    std::vector<double> values;
    for (std::size_t i = 0; i < places.size(); ++i) {
        for (std::size_t j = i + 1; j < places.size(); ++j) {
            values.push_back(f(std::abs(places[i] - places[j])));
        }
    }
    return values;
}

TriangleCheck check(const DistanceTable& table) {
    return check_triangles(table, kFirst).at(0);
}

TEST(Triangle, SquaresBreakItMostInTheMiddle) {
    // Between 0 and 9, 4 is the place nearest to the middle: 81 against 16 + 25. (Of 1, 4 and 9 it
    // is 64 against 9 + 25, of 0, 1 and 4 16 against 1 + 9.)
    const auto result = check(make_table(on_a_line({4, 9, 0, 1}, [](double d) { return d * d; })));
    EXPECT_EQ(result.triples, 12U);
    EXPECT_EQ(result.violations, 4U);  // a place between two others, once for each three
    ASSERT_TRUE(result.worst);
    EXPECT_EQ(*result.worst, (Triple{1, 0, 2, 25, 16, 81, 40.0 / 41}));
    EXPECT_EQ(result.worst->ratio(), 81.0 / 41);
}

TEST(Triangle, OfEqualOnesTheFirstPairThenTheFirstMiddle) {
    // 0, 1 and 2 break it by the same factor as 1, 2 and 3, and 0, 2 and 4.
    const auto squares = [](double d) { return d * d; };
    EXPECT_EQ(*check(make_table(on_a_line({0, 1, 2, 3, 4}, squares))).worst,
              (Triple{0, 1, 2, 1, 1, 4, 1}));
    EXPECT_EQ(*check(make_table(on_a_line({4, 2, 0, 1, 3}, squares))).worst,
              (Triple{0, 4, 1, 1, 1, 4, 1}));
    // Two materials in the middle.
    EXPECT_EQ(*check(make_table(on_a_line({2, 1, 1, 0}, squares))).worst,
              (Triple{0, 1, 3, 1, 1, 4, 1}));
}

TEST(Triangle, MetricsKeepIt) {
    const std::vector<double> places = {3, 0, 7, 20, 21};
    for (const auto& values : {on_a_line(places, [](double d) { return d; }),
                               on_a_line(places, [](double d) { return std::sqrt(d); })}) {
        const auto result = check(make_table(values));
        EXPECT_EQ(result.violations, 0U);
        EXPECT_LE(result.worst->excess, 0);
    }
}

TEST(Triangle, TheLastBitIsSeen) {
    const double ulp = std::numeric_limits<double>::epsilon();
    // The sum of 1 and 0.6 ulp is rounded up to 1 + ulp, which is more than it is.
    const auto above = check(make_table({1, 1 + ulp, 0.6 * ulp}));  // ab, ac, bc
    EXPECT_EQ(above.violations, 1U);
    EXPECT_NEAR(above.worst->excess / (0.4 * ulp), 1, 1e-12);
    EXPECT_EQ(above.worst->ratio(), 1);
    // That of 1 and 0.4 ulp is rounded down to 1.
    EXPECT_EQ(check(make_table({1, 1, 0.4 * ulp})).violations, 0U);
    EXPECT_EQ(check(make_table({1, 1, 0})).violations, 0U);
    EXPECT_EQ(check(make_table({1, 1, 0})).worst->excess, 0);
}

TEST(Triangle, ZerosAndLargestNumbers) {
    const auto apart = check(make_table({0, 3, 0}));  // a and c are at b, and 3 from each other
    EXPECT_EQ(apart.violations, 1U);
    EXPECT_EQ(apart.worst->excess, kInfinity);
    EXPECT_EQ(apart.worst->ratio(), kInfinity);
    EXPECT_EQ(apart.worst->b, 1U);

    const auto same = check(make_table({0, 0, 0}));
    EXPECT_EQ(same.violations, 0U);
    EXPECT_FALSE(same.worst);

    const double largest = std::numeric_limits<double>::max();
    const double least = std::numeric_limits<double>::denorm_min();
    EXPECT_EQ(check(make_table({largest, largest, largest})).violations, 0U);
    EXPECT_EQ(check(make_table({least, 3 * least, least})).violations, 1U);
    EXPECT_EQ(check(make_table({least, 2 * least, least})).violations, 0U);
    EXPECT_EQ(check(make_table({least, largest, 0})).worst->excess, kInfinity);
}

TEST(Triangle, TwoMaterialsHaveNone) {
    const auto result = check(make_table({1}));
    EXPECT_EQ(result.triples, 0U);
    EXPECT_EQ(result.violations, 0U);
    EXPECT_FALSE(result.worst);
}

/// Word by word, of whole numbers, whose sums are exact.
TriangleCheck plain_check(const DistanceTable& table) {
    const auto n = table.materials();
    const auto d = [&](std::uint32_t i, std::uint32_t j) {
        return table.metrics[0].values[pair_index({std::min(i, j), std::max(i, j)}, n)];
    };
    TriangleCheck result = {0, 0, 0, {}};
    for (std::uint32_t a = 0; a < n; ++a) {
        for (std::uint32_t c = a + 1; c < n; ++c) {
            for (std::uint32_t b = 0; b < n; ++b) {
                if (b == a || b == c) {
                    continue;
                }
                ++result.triples;
                const double sum = d(a, b) + d(b, c);
                *result.violations += d(a, c) > sum ? 1 : 0;
                const double excess = (d(a, c) - sum) / sum;
                if (!result.worst || excess > result.worst->excess) {
                    result.worst = {a, b, c, d(a, b), d(b, c), d(a, c), excess};
                }
            }
        }
    }
    return result;
}

TEST(Triangle, IsThatOfAPlainProgramOnAnyNumberOfThreads) {
    std::mt19937_64 random(5);
    for (const std::uint32_t materials : {3U, 4U, 7U, 30U, 101U}) {
        std::vector<double> values(pair_count(materials));
        for (auto& value : values) {
            value = static_cast<double>(1 + random() % 9);  // many ties
        }
        const auto table = make_table(values);
        const auto expected = plain_check(table);
        for (const int threads : {1, 4}) {
            testing::with_threads(threads, [&] {
                const auto found = check(table);
                EXPECT_EQ(found.triples, expected.triples);
                EXPECT_EQ(found.violations, expected.violations);
                EXPECT_EQ(found.worst, expected.worst);
            });
        }
    }
}

TEST(Triangle, OnlyTheMetricsThatAreAskedFor) {
    auto table = make_table({1, 1, 1});
    table.metrics.push_back({"other", {1, 5, 1}, {}});
    EXPECT_TRUE(check_triangles(table, {}).empty());
    const auto result = check_triangles(table, std::array<std::size_t, 2>{1, 0});
    ASSERT_EQ(result.size(), 2U);
    EXPECT_EQ(result[0].metric, 1U);
    EXPECT_EQ(result[0].violations, 1U);
    EXPECT_EQ(result[1].metric, 0U);
    EXPECT_EQ(result[1].violations, 0U);
}

TEST(Triangle, TooManyAreNotLookedAt) {
    const auto table = make_table(std::vector<double>(pair_count(2200), 1));
    const auto result = check(table);
    EXPECT_EQ(result.triples, pair_count(2200) * 2198);
    EXPECT_FALSE(result.violations);
    EXPECT_FALSE(result.worst);
}

TEST(Triangle, WhatProgressThrowsComesOut) {
    const auto table = make_table({1, 2, 3, 1, 2, 3});
    EXPECT_THROW(check_triangles(table, kFirst, [](double) { throw std::runtime_error("stop"); }),
                 std::runtime_error);
    double last = 0;
    check_triangles(table, kFirst, [&](double share) {
        EXPECT_GE(share, last);
        last = share;
    });
    EXPECT_EQ(last, 1);
}

TEST(WriteTriangles, LeavesEmptyWhatThereIsNot) {
    DistanceTable table = {{"a", "b,1", "c"}, {{"x", {1, 4, 1}, {}}, {"y,z", {0, 0, 0}, {}}}};
    auto checks = check_triangles(table, std::array<std::size_t, 2>{0, 1});
    checks.push_back({1, 3, {}, {}});
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    write_triangles(::fileno(file.get()), table, checks);
    std::string text(static_cast<std::size_t>(::lseek(::fileno(file.get()), 0, SEEK_END)), '\0');
    EXPECT_EQ(::pread(::fileno(file.get()), text.data(), text.size(), 0),
              static_cast<ssize_t>(text.size()));
    EXPECT_EQ(text,
              "metric,triples,violations,a,b,c,distance_ab,distance_bc,distance_ac,ratio,excess\n"
              "x,3,1,a,\"b,1\",c,1,1,4,2,1\n"
              "\"y,z\",3,0,,,,,,,,\n"
              "\"y,z\",3,,,,,,,,,\n");
}

}  // namespace
}  // namespace merl::scan
