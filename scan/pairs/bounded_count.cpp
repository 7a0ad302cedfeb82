#include "scan/pairs/bounded_count.h"

#include <algorithm>
#include <cstddef>
#include <functional>
#include <span>
#include <utility>
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

void sort(std::span<Keyed> keyed, const Progress& progress) {
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
    const auto filling_progress = part_of(progress, 0, 0.1);
    Work filling(static_cast<double>(pairs), filling_progress);
    in_parallel(pairs, filling, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t pair = begin; pair < end; ++pair) {
            lows[pair] = {metric.values[pair] - metric.bound(pair), pair};
        }
    });
    sort(lows, part_of(progress, 0.1, 0.6));
    Places places = {std::vector<std::uint32_t>(pairs), std::vector<std::uint32_t>(pairs)};
    const auto placing_progress = part_of(progress, 0.7, 0.3);
    Work placing(static_cast<double>(pairs), placing_progress);
    in_parallel(pairs, placing, [&](std::uint32_t first, std::uint32_t last) {
        for (std::size_t place = first; place < last; ++place) {
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
    });
    return places;
}

/// Two numbers of each pair, in the order of its two ends under one metric: `above(pair)` at the
/// lower end and `below(pair)` at the upper one. So below(a) comes before above(b) exactly where a
/// is surely below b.
template <typename Below, typename Above>
std::vector<std::uint32_t> in_order_of(const Places& first, const Below& below, const Above& above,
                                       const Progress& progress) {
    const std::size_t pairs = first.place.size();
    Work work(3 * static_cast<double>(pairs), progress);
    // How many upper ends are before each lower end: then where the next upper end goes.
    std::vector<std::uint32_t> before(pairs + 1);
    in_pieces(pairs, work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t pair = begin; pair < end; ++pair) {
            ++before[first.beyond[pair]];
        }
    });
    std::uint32_t sum = 0;
    for (auto& count : before) {
        sum += std::exchange(count, sum);
    }
    std::vector<std::uint32_t> numbers(2 * pairs);
    in_pieces(pairs, work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t pair = begin; pair < end; ++pair) {
            const auto beyond = first.beyond[pair];
            numbers[std::size_t{beyond} + before[beyond]++] = below(pair);
        }
    });
    // Now before[i] counts the upper ends up to i.
    in_parallel(pairs, work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t pair = begin; pair < end; ++pair) {
            const auto place = first.place[pair];
            numbers[std::size_t{place} + before[place]] = above(pair);
        }
    });
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
    const auto ordering = part_of(progress, 0, 0.3);
    auto numbers = alike ? in_order_of(
                               first, [&](std::uint32_t pair) { return last - high(pair); },
                               [&](std::uint32_t pair) { return last - low(pair); }, ordering)
                         : in_order_of(first, low, high, ordering);
    const auto is_odd = [](std::uint32_t number) { return number % 2 == 1; };
    const auto is_even = [](std::uint32_t number) { return number % 2 == 0; };
    return InversionCount<std::uint32_t, decltype(is_odd), decltype(is_even)>(is_odd, is_even)
        .sort(numbers, part_of(progress, 0.3, 0.7));
}

/// Of the configurations that tie under one metric, how many ...
struct Ties {
    std::uint64_t ordered = 0;  // ... are surely in order under the other
    std::uint64_t tied = 0;     // ... tie there too
};

/// Of some pairs, how many configurations are surely in order.
std::uint64_t count_ordered(std::span<const Keyed> pairs, const Places& places,
                            const Progress& progress) {
    std::vector<std::uint32_t> place(pairs.size());
    std::vector<std::uint32_t> beyond(pairs.size());
    for (std::size_t i = 0; i < pairs.size(); ++i) {
        place[i] = places.place[pairs[i].pair];
        beyond[i] = places.beyond[pairs[i].pair];
    }
    sort_with_progress(place, std::less<>(), progress);
    sort_with_progress(beyond, std::less<>(), progress);
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
    sort(exact, part_of(progress, 0, 0.5));
    // The rest is quick unless much ties. How long it takes is not known.
    const auto at_work = part_of(progress, 0.5, 0);
    Ties ties;
    for (auto begin = exact.begin(); begin != exact.end();) {
        auto end = begin + 1;
        while (end != exact.end() && end->key == begin->key) {
            ++end;
        }
        if (end - begin > 1) {
            ties.ordered += count_ordered({begin, end}, other_places, at_work);
            // By their distances under the other metric, those that tie there.
            const auto tied_end = std::partition(
                begin, end, [&](const Keyed& keyed) { return other.ties(keyed.pair); });
            std::span tied(begin, tied_end);
            for (auto& [key, pair] : tied) {
                key = other.values[pair];
            }
            sort(tied, at_work);
            ties.tied += count_equal(tied);
        }
        begin = end;
    }
    return ties;
}

}  // namespace

BoundedCount bound_disagreements(const DistancesView& distances, const Progress& progress) {
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
