#include "scan/select/undecided.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <iterator>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>

#include "scan/select/agreement_doubts.h"
#include "scan/select/disagreement_search.h"
#include "scan/select/participation.h"

namespace merl::scan {
namespace {

/// So many configurations are compared with one that is selected. There are more where materials
/// have copies: a thousand copied pairs make a million configurations of one agreement.
constexpr std::size_t most_compared = 1U << 18U;

double lower(std::span<const double> values, std::span<const double> bounds, std::uint32_t pair) {
    return values[pair] - bounds[pair];
}

double upper(std::span<const double> values, std::span<const double> bounds, std::uint32_t pair) {
    return values[pair] + bounds[pair];
}

std::vector<std::uint32_t> by_lower_end(std::span<const double> values,
                                        std::span<const double> bounds) {
    std::vector<std::uint32_t> order(values.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(order, std::less<>(), [&](std::uint32_t pair) {
        return std::pair(lower(values, bounds, pair), pair);
    });
    return order;
}

/// Adds, of the pairs in `order`, the inexact ones whose interval meets another one's and that
/// `which` takes.
void add_meeting(std::span<const double> values, std::span<const double> bounds,
                 std::span<const std::uint32_t> order, const auto& which,
                 std::vector<bool>& meeting) {
    double highest = -std::numeric_limits<double>::infinity();  // upper end so far
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::uint32_t pair = order[i];
        const bool meets_earlier = lower(values, bounds, pair) <= highest;
        const bool meets_later = i + 1 < order.size() &&
                                 lower(values, bounds, order[i + 1]) <= upper(values, bounds, pair);
        if (bounds[pair] > 0 && (meets_earlier || meets_later) && which(pair)) {
            meeting[pair] = true;
        }
        highest = std::max(highest, upper(values, bounds, pair));
    }
}

/// What the selection and its order rest on.
class SelectionDoubts {
  public:
    SelectionDoubts(const Distances& distances, std::span<const double> first_bounds,
                    std::span<const double> second_bounds)
        : distances_(distances),
          doubts_(distances.first, first_bounds, distances.second, second_bounds),
          wanted_(doubts_.loose()) {}

    std::vector<bool> find(std::uint32_t select, std::uint32_t per_material) {
        if (doubts_.none()) {
            return wanted_;  // all are exact or asked for
        }
        DisagreementSearch search(distances_);
        Participation participation(distances_.materials(), per_material);
        std::deque<Configuration> ahead;  // yielded by the search and not yet taken
        bool more = true;
        for (std::uint32_t chosen = 0; chosen < select && per_material > 0;) {
            const auto closed = [&](const Configuration& c) {
                return !participation.open(c.left) || !participation.open(c.right);
            };
            std::erase_if(ahead, closed);
            // Whatever could come before the first in line has been yielded once the search is past
            // the worst doubt.
            while (more && ahead.size() < most_compared &&
                   (ahead.empty() || !doubts_.surely_after(ahead.back(), ahead.front()))) {
                if (const auto found = search.next()) {
                    ahead.push_back(*found);
                } else {
                    more = false;
                }
            }
            if (ahead.empty()) {
                break;
            }
            if (ahead.size() >= most_compared) {
                want_all_open(participation);
                break;
            }
            const Configuration taken = ahead.front();
            ahead.pop_front();
            want(taken);
            for (const auto& other : ahead) {
                if (doubts_.may_come_before(other, taken)) {
                    want(other);
                }
            }
            participation.take(taken, search);
            ++chosen;
        }
        return wanted_;
    }

  private:
    void want(const Configuration& c) {
        wanted_[c.left] = true;
        wanted_[c.right] = true;
    }

    /// Instead of finding out which of them matter.
    void want_all_open(const Participation& participation) {
        for (std::uint32_t pair = 0; pair < distances_.pairs(); ++pair) {
            if (participation.open(pair)) {
                wanted_[pair] = true;
            }
        }
    }

    const Distances& distances_;
    AgreementDoubts doubts_;
    std::vector<bool> wanted_;
};

/// Where a distance may be.
struct Range {
    double value;
    double low;
    double high;
    bool ties;  // with others that are equal: there is nothing more exact
};

Range range_of(std::span<const double> values, std::span<const double> bounds, bool is_final,
               std::uint32_t pair) {
    return {values[pair], lower(values, bounds, pair), upper(values, bounds, pair),
            is_final || bounds[pair] == 0};
}

/// Where the two distances of a pair may be.
struct Place {
    Range first;
    Range second;
};

using Places = std::vector<Place>;

std::uint64_t pairs_of(std::uint64_t things) {
    return things * (things - 1) / 2;
}

std::vector<Range> projected(const Places& places, Range Place::*metric) {
    std::vector<Range> ranges;
    ranges.reserve(places.size());
    for (const auto& place : places) {
        ranges.push_back(place.*metric);
    }
    return ranges;
}

/// How many pairs of ranges meet. O(n log n).
std::uint64_t count_meeting(std::vector<Range> ranges) {
    std::ranges::sort(ranges, {}, &Range::low);
    std::uint64_t count = 0;
    for (auto range = ranges.begin(); range != ranges.end(); ++range) {
        const auto beyond =
            std::ranges::upper_bound(range, ranges.end(), range->high, {}, &Range::low);
        count += static_cast<std::uint64_t>(beyond - range - 1);
    }
    return count;
}

/// The sum of `of_tie` over all places that tie under a metric.
template <typename OfTie>
std::uint64_t sum_over_ties(const Places& places, Range Place::*metric, const OfTie& of_tie) {
    Places exact;
    std::ranges::copy_if(places, std::back_inserter(exact),
                         [=](const Place& place) { return (place.*metric).ties; });
    const auto value = [=](const Place& place) { return (place.*metric).value; };
    std::ranges::sort(exact, {}, value);
    std::uint64_t sum = 0;
    for (auto begin = exact.begin(); begin != exact.end();) {
        const auto end = std::ranges::upper_bound(begin, exact.end(), value(*begin), {}, value);
        if (end - begin > 1) {
            sum += of_tie(Places(begin, end));
        }
        begin = end;
    }
    return sum;
}

/// Numbers that are there, out of those that may be; and how many of them are below or above one
/// (P. Fenwick, "A new data structure for cumulative frequency tables", 1994).
class Tally {
  public:
    explicit Tally(std::vector<double> numbers)
        : sorted_(std::move(numbers)), sums_(sorted_.size() + 1) {
        std::ranges::sort(sorted_);
    }

    void add(double number) { change(number, 1); }
    void remove(double number) { change(number, -1); }
    std::int64_t below(double number) const {
        return sum(std::ranges::lower_bound(sorted_, number));
    }
    std::int64_t up_to(double number) const {
        return sum(std::ranges::upper_bound(sorted_, number));
    }

  private:
    using Iterator = std::vector<double>::const_iterator;

    void change(double number, std::int64_t by) {
        auto i =
            static_cast<std::size_t>(std::ranges::lower_bound(sorted_, number) - sorted_.begin()) +
            1;
        for (; i < sums_.size(); i += i & (~i + 1)) {
            sums_[i] += by;
        }
    }

    std::int64_t sum(Iterator end) const {
        std::int64_t total = 0;
        for (auto i = static_cast<std::size_t>(end - sorted_.begin()); i > 0; i -= i & (~i + 1)) {
            total += sums_[i];
        }
        return total;
    }

    std::vector<double> sorted_;
    std::vector<std::int64_t> sums_;
};

/// How many pairs of places meet under both metrics: the ranges of the first metric in ascending
/// order, each against those before it that reach so far. O(n log n).
std::uint64_t count_meeting_in_both(const Places& places) {
    Places by_low = places;
    Places by_high = places;
    std::ranges::sort(by_low, {}, [](const Place& place) { return place.first.low; });
    std::ranges::sort(by_high, {}, [](const Place& place) { return place.first.high; });
    std::vector<double> lows;
    std::vector<double> highs;
    for (const auto& place : places) {
        lows.push_back(place.second.low);
        highs.push_back(place.second.high);
    }
    Tally low(std::move(lows));
    Tally high(std::move(highs));
    std::int64_t count = 0;
    auto gone = by_high.begin();
    for (const auto& place : by_low) {
        for (; gone->first.high < place.first.low; ++gone) {
            low.remove(gone->second.low);
            high.remove(gone->second.high);
        }
        count += low.up_to(place.second.high) - high.below(place.second.low);
        low.add(place.second.low);
        high.add(place.second.high);
    }
    return static_cast<std::uint64_t>(count);
}

}  // namespace

/// The inexact distances whose interval meets another one's, but of those that are met only by
/// loose ones just these: once they are exact, few are likely to be left.
std::vector<bool> find_meeting(std::span<const double> values, std::span<const double> bounds) {
    std::vector<bool> meeting(values.size());
    auto order = by_lower_end(values, bounds);
    const auto loose = [&](std::uint32_t pair) { return is_loose(values[pair], bounds[pair]); };
    add_meeting(values, bounds, order, loose, meeting);
    std::erase_if(order, [&](std::uint32_t pair) { return meeting[pair]; });
    add_meeting(
        values, bounds, order, [](std::uint32_t) { return true; }, meeting);
    return meeting;
}

Refinement to_refine(const Distances& distances, std::uint32_t select, std::uint32_t per_material) {
    distances.validate();
    if (distances.first_bounds.empty() || distances.second_bounds.empty()) {
        throw std::invalid_argument("refinement needs the bounds of both metrics");
    }
    // Of final distances there are none that are more exact, so those count as exact here.
    const std::vector<double> none(distances.pairs());
    const auto& first_bounds = distances.first_is_final ? none : distances.first_bounds;
    const auto& second_bounds = distances.second_is_final ? none : distances.second_bounds;
    const auto first = find_meeting(distances.first, first_bounds);
    const auto second = find_meeting(distances.second, second_bounds);
    const auto selected =
        SelectionDoubts(distances, first_bounds, second_bounds).find(select, per_material);
    Refinement result;
    for (std::uint32_t pair = 0; pair < distances.pairs(); ++pair) {
        if (first_bounds[pair] > 0 && (first[pair] || selected[pair])) {
            result.first.push_back(pair);
        }
        if (second_bounds[pair] > 0 && (second[pair] || selected[pair])) {
            result.second.push_back(pair);
        }
    }
    return result;
}

std::vector<OpenConfiguration> list_undecided(const Distances& distances, std::size_t most) {
    distances.validate();
    std::vector<OpenConfiguration> open;
    const auto add_open = [&](std::span<const double> values, std::span<const double> bounds,
                              const std::string& metric) {
        const auto order = by_lower_end(values, bounds);
        // The next place with another value: what ties is passed over at once, however much it is.
        std::vector<std::size_t> next(order.size(), order.size());
        for (std::size_t i = order.size(); i-- > 1;) {
            next[i - 1] = values[order[i - 1]] == values[order[i]] ? next[i] : i;
        }
        for (std::size_t i = 0; i < order.size() && open.size() < most; ++i) {
            const std::uint32_t one = order[i];
            for (std::size_t j = i + 1; j < order.size() && open.size() < most;) {
                const std::uint32_t other = order[j];
                if (values[one] == values[other]) {
                    j = next[j];
                } else if (lower(values, bounds, other) <= upper(values, bounds, one)) {
                    open.push_back({std::min(one, other), std::max(one, other), metric});
                    ++j;
                } else {
                    break;
                }
            }
        }
    };
    if (distances.first_is_final) {
        add_open(distances.first, distances.first_bounds, distances.first_metric);
    }
    if (distances.second_is_final) {
        add_open(distances.second, distances.second_bounds, distances.second_metric);
    }
    return open;
}

std::uint64_t count_undecided(const Distances& distances) {
    distances.validate();
    if (distances.first_bounds.empty() || distances.second_bounds.empty()) {
        return 0;
    }
    const auto& d = distances;
    std::vector<Place> places(d.pairs());
    for (std::uint32_t pair = 0; pair < d.pairs(); ++pair) {
        places[pair] = {range_of(d.first, d.first_bounds, d.first_is_final, pair),
                        range_of(d.second, d.second_bounds, d.second_is_final, pair)};
    }
    // Open under the first, under the second, and less those that are counted twice. Two distances
    // that tie are not open, and meet.
    const auto open = [&](Range Place::*metric) {
        return count_meeting(projected(places, metric)) -
               sum_over_ties(places, metric,
                             [](const Places& tie) { return pairs_of(tie.size()); });
    };
    const auto tied_and_meeting = [&](Range Place::*tied, Range Place::*meeting) {
        return sum_over_ties(places, tied, [=](const Places& tie) {
            return count_meeting(projected(tie, meeting));
        });
    };
    const std::uint64_t same = sum_over_ties(places, &Place::first, [](const Places& tie) {
        return sum_over_ties(tie, &Place::second,
                             [](const Places& both) { return pairs_of(both.size()); });
    });
    const std::uint64_t open_in_both = count_meeting_in_both(places) + same -
                                       tied_and_meeting(&Place::first, &Place::second) -
                                       tied_and_meeting(&Place::second, &Place::first);
    return open(&Place::first) + open(&Place::second) - open_in_both;
}

}  // namespace merl::scan
