#include "scan/pairs/bounded_count.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <stdexcept>

#include "scan/pairs/count.h"
#include "tests/scan/approximate_distances.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::approximate;
using testing::errors;
using testing::make_distances;
using testing::Random;
using testing::random_cases;

constexpr double infinity = std::numeric_limits<double>::infinity();

/// The order of two distances, or none where bounds leave it open.
std::optional<int> plain_order(const std::vector<double>& values, const std::vector<double>& bounds,
                               bool is_final, std::size_t a, std::size_t b) {
    const auto bound = [&](std::size_t pair) { return bounds.empty() ? 0 : bounds[pair]; };
    if (values[a] + bound(a) < values[b] - bound(b)) {
        return -1;
    }
    if (values[b] + bound(b) < values[a] - bound(a)) {
        return 1;
    }
    const bool can_tie = is_final || (bound(a) == 0 && bound(b) == 0);
    return can_tie && values[a] == values[b] ? std::optional(0) : std::nullopt;
}

/// By the definition, one configuration after the other.
BoundedCount plain_bounds(const Distances& d) {
    BoundedCount count;
    for (std::uint32_t a = 0; a < d.pairs(); ++a) {
        for (std::uint32_t b = a + 1; b < d.pairs(); ++b) {
            const auto first = plain_order(d.first, d.first_bounds, d.first_is_final, a, b);
            const auto second = plain_order(d.second, d.second_bounds, d.second_is_final, a, b);
            if (!first || !second) {
                ++count.undecided;
            } else if (first != second) {
                ++count.least;
            }
        }
    }
    return count;
}

/// Disagreements of which the bounds decide both signs, of distances of which no two are equal: a
/// tree of sums (P. Fenwick, "A new data structure for cumulative frequency tables", 1994) over the
/// second metric while the first ascends. Where `above`, of pairs below under the first those that
/// are above under the second, otherwise those that are below there, too.
std::uint64_t count_by_tree(const Distances& d, bool above) {
    const auto bound = [](const std::vector<double>& bounds, std::uint32_t pair) {
        return bounds.empty() ? 0 : bounds[pair];
    };
    const auto low = [&](std::uint32_t p) { return d.first[p] - bound(d.first_bounds, p); };
    const auto high = [&](std::uint32_t p) { return d.first[p] + bound(d.first_bounds, p); };
    // The end that counts of a pair that is entered, and of one that asks.
    const auto entered = [&](std::uint32_t p) {
        return d.second[p] + (above ? -1 : 1) * bound(d.second_bounds, p);
    };
    const auto asking = [&](std::uint32_t p) {
        return d.second[p] + (above ? 1 : -1) * bound(d.second_bounds, p);
    };
    std::vector<std::uint32_t> by_low(d.pairs());
    std::iota(by_low.begin(), by_low.end(), 0U);
    auto by_high = by_low;
    std::ranges::sort(by_low, {}, low);
    std::ranges::sort(by_high, {}, high);
    std::vector<double> ends;
    for (std::uint32_t pair = 0; pair < d.pairs(); ++pair) {
        ends.push_back(entered(pair));
    }
    std::ranges::sort(ends);
    std::vector<std::uint64_t> sums(ends.size() + 1);
    std::uint64_t inside = 0;
    std::uint64_t count = 0;
    auto next = by_high.begin();
    for (const auto pair : by_low) {
        for (; next != by_high.end() && high(*next) < low(pair); ++next, ++inside) {
            auto i = static_cast<std::size_t>(std::ranges::lower_bound(ends, entered(*next)) -
                                              ends.begin()) +
                     1;
            for (; i < sums.size(); i += i & (~i + 1)) {
                ++sums[i];
            }
        }
        auto i = static_cast<std::size_t>((above ? std::ranges::upper_bound(ends, asking(pair))
                                                 : std::ranges::lower_bound(ends, asking(pair))) -
                                          ends.begin());
        std::uint64_t up_to = 0;
        for (; i > 0; i &= i - 1) {
            up_to += sums[i];
        }
        count += above ? inside - up_to : up_to;
    }
    return count;
}

/// Calls `body(exact, approximate)` for every kind of data and of errors.
void for_each_case(std::uint64_t seeds,
                   const std::function<void(const Distances&, const Distances&)>& body) {
    for (const auto& random_case : testing::cases_with_near_ties()) {
        for (const auto& error : errors()) {
            for (std::uint64_t seed = 0; seed < seeds; ++seed) {
                SCOPED_TRACE(
                    fmt::format("{}, errors {}, seed {}", random_case.name, error.name, seed));
                Random random(seed);
                const auto materials = static_cast<std::uint32_t>(2 + random() % 12);
                const Distances exact = random_case.make(materials, seed);
                body(exact, approximate(exact, error, random));
                if (::testing::Test::HasFailure()) {
                    return;
                }
            }
        }
    }
}

TEST(BoundedCount, IsTheDefinition) {
    for_each_case(40, [](const Distances&, const Distances& d) {
        ASSERT_EQ(bound_disagreements(d), plain_bounds(d));
        for (const int final_ones : {1, 2, 3}) {
            Distances with_final = d;
            with_final.first_is_final = (final_ones & 1) != 0;
            with_final.second_is_final = (final_ones & 2) != 0;
            ASSERT_EQ(bound_disagreements(with_final), plain_bounds(with_final)) << final_ones;
        }
        Distances first_is_exact = d;
        first_is_exact.first_bounds.clear();
        ASSERT_EQ(bound_disagreements(first_is_exact), plain_bounds(first_is_exact));
    });
}

TEST(BoundedCount, TheExactNumberIsBetween) {
    for_each_case(40, [](const Distances& exact, const Distances& approximate) {
        const auto bounded = bound_disagreements(approximate);
        for (const auto* distances : {&exact, &approximate}) {
            const auto count = count_by_streaming(*distances).disagreements();
            ASSERT_LE(bounded.least, count);
            ASSERT_GE(bounded.greatest(), count);
        }
    });
}

TEST(BoundedCount, AnyDistancesWithinTheBoundsAreBetween) {
    for (std::uint64_t seed = 0; seed < 50; ++seed) {
        Random random(seed);
        std::uniform_real_distribution<double> share(-1, 1);
        Distances d = testing::near_ties(8, seed);
        for (auto* bounds : {&d.first_bounds, &d.second_bounds}) {
            for (std::uint32_t pair = 0; pair < d.pairs(); ++pair) {
                bounds->push_back(std::ldexp(1.0, -static_cast<int>(random() % 20)));
            }
        }
        const auto bounded = bound_disagreements(d);
        for (int i = 0; i < 100; ++i) {
            Distances within = d;
            for (std::uint32_t pair = 0; pair < d.pairs(); ++pair) {
                within.first[pair] += share(random) * d.first_bounds[pair];
                within.second[pair] += share(random) * d.second_bounds[pair];
            }
            for (auto* values : {&within.first, &within.second}) {
                std::ranges::transform(*values, values->begin(),
                                       [](double value) { return std::max(0.0, value); });
            }
            const auto count = count_by_streaming(within).disagreements();
            ASSERT_LE(bounded.least, count);
            ASSERT_GE(bounded.greatest(), count);
        }
    }
}

TEST(BoundedCount, OfExactDistancesIsTheCount) {
    for (const auto& random_case : random_cases()) {
        SCOPED_TRACE(random_case.name);
        Distances d = random_case.make(30, 3);
        const auto count = count_by_streaming(d).disagreements();
        EXPECT_EQ(bound_disagreements(d), (BoundedCount{count, 0}));
        d.first_bounds.assign(d.pairs(), 0);
        EXPECT_EQ(bound_disagreements(d), (BoundedCount{count, 0}));
        d.second_bounds.assign(d.pairs(), 1e-310);  // less than any of them can be moved by
        EXPECT_EQ(bound_disagreements(d), plain_bounds(d));
    }
}

TEST(BoundedCount, NothingIsKnownOfDistancesWithoutBounds) {
    Distances d = random_cases()[1].make(12, 4);
    d.first_bounds.assign(d.pairs(), infinity);
    EXPECT_EQ(bound_disagreements(d), (BoundedCount{0, d.configurations()}));
}

TEST(BoundedCount, ByHand) {
    // Under the first metric 1 and 2 touch, 3 is apart; under the second all are exact.
    Distances d = make_distances({1, 2, 4}, {5, 5, 3});
    d.first_bounds = {0.5, 0.5, 0};
    EXPECT_EQ(bound_disagreements(d), (BoundedCount{2, 1}));  // both of the third
    d.first_bounds = {0.25, 0.5, 0};
    EXPECT_EQ(bound_disagreements(d), (BoundedCount{3, 0}));  // tied in the second only
    d.first = {1, 1, 4};
    d.first_bounds = {0, 0, 0};
    EXPECT_EQ(bound_disagreements(d), (BoundedCount{2, 0}));  // tied in both
}

TEST(BoundedCount, OfManyIsThatOfATree) {
    // Enough that threads share the merges.
    for (const double relative : {0.0, 1e-9, 1e-5, 1e-2}) {
        SCOPED_TRACE(relative);
        Distances d = random_cases()[3].make(450, 5);
        for (std::uint32_t pair = 0; pair < d.pairs(); ++pair) {
            d.first_bounds.push_back(relative * d.first[pair]);
            d.second_bounds.push_back(relative * d.second[pair] / 2);
        }
        const auto unlike = count_by_tree(d, true);
        const auto alike = count_by_tree(d, false);
        for (const int threads : {1, 2, 5}) {
            testing::with_threads(threads, [&] {
                EXPECT_EQ(bound_disagreements(d),
                          (BoundedCount{unlike, d.configurations() - unlike - alike}));
            });
        }
        d.first_bounds.clear();
        d.second_bounds.clear();
        EXPECT_EQ(count_by_inversions(d).disagreements(), count_by_tree(d, true));
    }
}

TEST(BoundedCount, ManyThatTieTakeLittleTime) {
    // One by one that would be hours.
    Distances d = random_cases()[0].make(800, 6);
    d.first.assign(d.pairs(), 1);
    d.first_bounds.assign(d.pairs(), 0);
    d.second_bounds.assign(d.pairs(), 0);
    d.second_bounds[0] = infinity;
    const auto others = d.pairs() - std::uint64_t{1};
    EXPECT_EQ(bound_disagreements(d), (BoundedCount{configuration_count(others), others}));
}

TEST(BoundedCount, ProgressMayEndIt) {
    Distances d = random_cases()[0].make(300, 7);
    d.first_bounds.assign(d.pairs(), 1e-6);
    double last = 0;
    bound_disagreements(d, [&](double share) {
        EXPECT_GE(share, last);
        EXPECT_LE(share, 1);
        last = share;
    });
    EXPECT_GT(last, 0.5);
    for (const double end : {0.0, 0.3, 0.7}) {
        const auto stop = [&](double share) {
            if (share >= end) {
                throw std::runtime_error("enough");
            }
        };
        EXPECT_THROW(bound_disagreements(d, stop), std::runtime_error) << end;
    }
    d.first_bounds.clear();
    const auto stop = [](double) { throw std::runtime_error("enough"); };
    EXPECT_THROW(count_by_inversions(d, stop), std::runtime_error);
    EXPECT_THROW(count_by_streaming(d, stop), std::runtime_error);
    EXPECT_THROW(count_disagreements(d, stop), std::runtime_error);
}

}  // namespace
}  // namespace merl::scan
