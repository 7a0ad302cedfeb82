#include "scan/pairs/bounded_count.h"

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <span>
#include <vector>

#include "scan/pairs/count.h"
#include "scan/pairs/merge_count.h"

namespace merl::scan {
namespace {

/// A number of a pair, to sort pairs by.
struct Keyed {
    double key;
    std::uint32_t pair;
};

void sort(std::vector<Keyed>& keyed, const Progress& progress) {
    sort_with_progress(
        keyed, [](const Keyed& a, const Keyed& b) { return a.key < b.key; }, progress);
}

/// The distances under one metric.
struct Metric {
    std::span<const double> values;
    std::span<const double> bounds;  // none: all are exact
    bool is_final;

    double bound(std::size_t pair) const { return bounds.empty() ? 0 : bounds[pair]; }
    /// With others that are equal: there is nothing more exact.
    bool ties(std::size_t pair) const { return is_final || bound(pair) == 0; }
    bool all_exact() const {
        return std::ranges::all_of(bounds, [](double bound) { return bound == 0; });
    }
};

/// Where the intervals of pairs are, as whole numbers: pair a is surely below pair b where
/// beyond[a] <= place[b].
struct Places {
    std::vector<std::uint32_t> place;   // of the lower end among all lower ends
    std::vector<std::uint32_t> beyond;  // how many lower ends are no higher than the upper end
};

Places places_of(const Metric& metric, const Progress& progress) {
    const std::size_t pairs = metric.values.size();
    std::vector<Keyed> lows(pairs);
    for (std::uint32_t pair = 0; pair < pairs; ++pair) {
        lows[pair] = {metric.values[pair] - metric.bound(pair), pair};
    }
    sort(lows, part_of(progress, 0, 0.8));
    Places places = {std::vector<std::uint32_t>(pairs), std::vector<std::uint32_t>(pairs)};
    const Progress rest = part_of(progress, 0.8, 0.2);
    Work work(static_cast<double>(pairs), rest);
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, pairs, 1U << 14U), [&](const auto& range) {
        for (std::size_t place = range.begin(); place < range.end(); ++place) {
            const auto pair = lows[place].pair;
            const double high = metric.values[pair] + metric.bound(pair);
            // The end is near, for most: in steps that double.
            std::size_t step = 1;
            while (place + step < pairs && lows[place + step].key <= high) {
                step *= 2;
            }
            const auto begin = lows.begin() + static_cast<std::ptrdiff_t>(place + step / 2);
            const auto end =
                lows.begin() + static_cast<std::ptrdiff_t>(std::min(place + step, pairs));
            const auto beyond = std::ranges::upper_bound(begin, end, high, {}, &Keyed::key);
            places.place[pair] = static_cast<std::uint32_t>(place);
            places.beyond[pair] = static_cast<std::uint32_t>(beyond - lows.begin());
        }
        work.add(range.size());
    });
    return places;
}

/// Numbers of all pairs in the order of one metric, so that the second of two is from a pair that
/// is surely above that of the first exactly where the first is `below(a)` and the second
/// `above(b)`.
template <typename Below, typename Above>
std::vector<std::uint32_t> in_order_of(const Places& first, const Below& below,
                                       const Above& above) {
    const std::size_t pairs = first.place.size();
    // How many upper ends are before each lower end: then where the next upper end goes.
    std::vector<std::uint32_t> before(pairs + 1);
    for (const auto beyond : first.beyond) {
        ++before[beyond];
    }
    std::uint32_t sum = 0;
    for (auto& count : before) {
        sum += std::exchange(count, sum);
    }
    std::vector<std::uint32_t> numbers(2 * pairs);
    for (std::uint32_t pair = 0; pair < pairs; ++pair) {
        const auto beyond = first.beyond[pair];
        numbers[std::size_t{beyond} + before[beyond]++] = below(pair);
    }
    // Now before[i] counts the upper ends up to i.
    for (std::uint32_t pair = 0; pair < pairs; ++pair) {
        const auto place = first.place[pair];
        numbers[std::size_t{place} + before[place]] = above(pair);
    }
    return numbers;
}

/// How many configurations have one pair surely below the other under the first metric, and surely
/// above or, where `alike`, below it under the second.
std::uint64_t count_ordered(const Places& first, const Places& second, bool alike,
                            const Progress& progress) {
    // Lower ends are odd numbers and upper ends even, in the order of the second metric: an upper
    // end is below a lower one where beyond <= place. The pair that is lower under the first is to
    // be found by an odd number, so where both are alike they are counted downwards.
    const auto last = static_cast<std::uint32_t>(2 * first.place.size() + 1);
    const auto low = [&](std::uint32_t pair) { return 2 * second.place[pair] + 1; };
    const auto high = [&](std::uint32_t pair) { return 2 * second.beyond[pair]; };
    auto numbers = alike ? in_order_of(
                               first, [&](std::uint32_t pair) { return last - high(pair); },
                               [&](std::uint32_t pair) { return last - low(pair); })
                         : in_order_of(first, low, high);
    const auto is_odd = [](std::uint32_t number) { return number % 2 == 1; };
    const auto is_even = [](std::uint32_t number) { return number % 2 == 0; };
    return InversionCount<std::uint32_t, decltype(is_odd), decltype(is_even)>(is_odd, is_even)
        .sort(numbers, progress);
}

/// Of the configurations that tie under one metric, how many ...
struct Ties {
    std::uint64_t ordered = 0;  // ... are surely in order under the other
    std::uint64_t tied = 0;     // ... tie there too
};

/// Of some pairs, how many configurations are surely in order.
std::uint64_t count_ordered(std::span<const Keyed> pairs, const Places& places) {
    std::vector<std::uint32_t> place;
    std::vector<std::uint32_t> beyond;
    for (const auto& [value, pair] : pairs) {
        place.push_back(places.place[pair]);
        beyond.push_back(places.beyond[pair]);
    }
    sort_with_progress(place, std::less<>(), {});
    sort_with_progress(beyond, std::less<>(), {});
    std::uint64_t count = 0;
    std::size_t below = 0;
    for (const auto above : place) {
        while (below < beyond.size() && beyond[below] <= above) {
            ++below;
        }
        count += below;
    }
    return count;
}

/// Of pairs in order, how many configurations have equal keys.
std::uint64_t count_equal(std::span<const Keyed> sorted) {
    std::uint64_t count = 0;
    std::uint64_t run = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
        run = sorted[i - 1].key == sorted[i].key ? run + 1 : 0;
        count += run;
    }
    return count;
}

Ties count_ties(const Metric& metric, const Metric& other, const Places& other_places,
                const Progress& progress) {
    std::vector<Keyed> exact;
    exact.reserve(metric.values.size());
    for (std::uint32_t pair = 0; pair < metric.values.size(); ++pair) {
        if (metric.ties(pair)) {
            exact.push_back({metric.values[pair], pair});
        }
    }
    sort(exact, progress);
    Ties ties;
    for (auto begin = exact.begin(); begin != exact.end();) {
        auto end = begin + 1;
        while (end != exact.end() && end->key == begin->key) {
            ++end;
        }
        if (end - begin > 1) {
            ties.ordered += count_ordered({begin, end}, other_places);
            // By their distances under the other metric, those that tie there.
            const auto tied_end = std::partition(
                begin, end, [&](const Keyed& keyed) { return other.ties(keyed.pair); });
            std::for_each(begin, tied_end,
                          [&](Keyed& keyed) { keyed.key = other.values[keyed.pair]; });
            std::sort(begin, tied_end,
                      [](const Keyed& a, const Keyed& b) { return a.key < b.key; });
            ties.tied += count_equal({begin, tied_end});
        }
        begin = end;
    }
    return ties;
}

}  // namespace

BoundedCount bound_disagreements(const Distances& distances, const Progress& progress) {
    distances.validate();
    const Metric first = {distances.first, distances.first_bounds, distances.first_is_final};
    const Metric second = {distances.second, distances.second_bounds, distances.second_is_final};
    if (first.all_exact() && second.all_exact()) {
        return {count_by_inversions(distances, progress).disagreements(), 0};
    }
    const Places places = places_of(first, part_of(progress, 0, 0.2));
    const Places other = places_of(second, part_of(progress, 0.2, 0.2));
    const Ties in_first = count_ties(first, second, other, part_of(progress, 0.4, 0.1));
    const Ties in_second = count_ties(second, first, places, part_of(progress, 0.5, 0.1));
    const auto unlike = count_ordered(places, other, false, part_of(progress, 0.6, 0.2));
    const auto alike = count_ordered(places, other, true, part_of(progress, 0.8, 0.2));
    const auto least = unlike + in_first.ordered + in_second.ordered;
    return {least, distances.configurations() - least - alike - in_first.tied};
}

}  // namespace merl::scan
