#include "scan/select/undecided.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <span>

#include "scan/select/agreement_doubts.h"
#include "scan/select/disagreement_search.h"
#include "scan/select/participation.h"

namespace merl::scan {
namespace {

/// So many configurations are looked at before what they rest on is asked for. There are more where
/// materials have copies: a thousand copied pairs make a million configurations of one agreement.
constexpr std::size_t most_compared = 1U << 18U;

/// Where the signs alone make one in so many pairs wanted, the selection is looked for when these
/// are exact: the search takes about as long as refining so many.
constexpr std::uint64_t kShareToWaitFor = 8;

/// The distances under one metric, and how far off they may be.
struct Column {
    std::span<const double> values;
    std::span<const double> bounds;  // none: there is nothing more exact

    double bound(std::uint32_t pair) const { return bounds.empty() ? 0 : bounds[pair]; }
    double lower(std::uint32_t pair) const { return values[pair] - bound(pair); }
    double upper(std::uint32_t pair) const { return values[pair] + bound(pair); }
    bool all_exact() const {
        return std::ranges::all_of(bounds, [](double bound) { return bound == 0; });
    }
};

/// A pair by the lower end of its interval.
struct LowerEnd {
    double lower;
    std::uint32_t pair;
};

std::vector<LowerEnd> by_lower_end(const Column& column, const Progress& progress) {
    std::vector<LowerEnd> order(column.values.size());
    const auto filling = part_of(progress, 0, 0.1);
    Work work(static_cast<double>(order.size()), filling);
    in_parallel(order.size(), work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t pair = begin; pair < end; ++pair) {
            order[pair] = {column.lower(pair), pair};
        }
    });
    sort_with_progress(
        order,
        [](const LowerEnd& a, const LowerEnd& b) {
            return a.lower < b.lower || (a.lower == b.lower && a.pair < b.pair);
        },
        part_of(progress, 0.1, 0.9));
    return order;
}

/// Adds, of the pairs in `order`, the inexact ones whose interval meets another one's and that
/// `which` takes.
void add_meeting(const Column& column, std::span<const LowerEnd> order, const auto& which,
                 Work& work, std::vector<bool>& meeting) {
    double highest = -std::numeric_limits<double>::infinity();  // upper end so far
    in_pieces(order.size(), work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t i = begin; i < end; ++i) {
            const auto [lower, pair] = order[i];
            const double upper = column.upper(pair);
            const bool meets_earlier = lower <= highest;
            const bool meets_later = i + 1 < order.size() && order[i + 1].lower <= upper;
            if (column.bound(pair) > 0 && (meets_earlier || meets_later) && which(pair)) {
                meeting[pair] = true;
            }
            highest = std::max(highest, upper);
        }
    });
}

/// The inexact distances whose interval meets another one's, but of those that are met only by
/// loose ones just these: once they are exact, few are likely to be left.
std::vector<bool> find_meeting(const Column& column, const Progress& progress) {
    std::vector<bool> meeting(column.values.size());
    if (column.bounds.empty()) {
        return meeting;
    }
    auto order = by_lower_end(column, part_of(progress, 0, 0.8));
    const auto comparing = part_of(progress, 0.8, 0.2);
    Work work(3 * static_cast<double>(order.size()), comparing);
    const auto loose = [&](std::uint32_t pair) {
        return is_loose(column.values[pair], column.bounds[pair]);
    };
    add_meeting(column, order, loose, work, meeting);
    std::erase_if(order, [&](const LowerEnd& end) {
        work.add_one();
        return meeting[end.pair];
    });
    add_meeting(
        column, order, [](std::uint32_t) { return true; }, work, meeting);
    return meeting;
}

/// What the selection and its order rest on: a selection among what could be disagreements, by the
/// least agreement that each could have.
class SelectionDoubts {
  public:
    /// What is `wanted` already is taken for exact.
    SelectionDoubts(const Distances& distances, const Column& first, const Column& second,
                    std::vector<bool> wanted)
        : distances_(distances), first_(first), second_(second), wanted_(std::move(wanted)) {}

    std::vector<bool> find(std::uint32_t select, std::uint32_t per_material,
                           const Progress& progress) {
        if (first_.all_exact() && second_.all_exact()) {
            return wanted_;
        }
        // What is found does not change where the search looks.
        const auto places = [this, before = wanted_](std::uint32_t pair) {
            const auto [d1_least, d1_greatest] = interval(first_, pair, before);
            const auto [d2_least, d2_greatest] = interval(second_, pair, before);
            return PairPlace{d1_least, d1_greatest, d2_least, d2_greatest};
        };
        DisagreementSearch search(distances_.pairs(), places, progress);
        Participation participation(distances_.materials(), per_material);
        std::deque<Configuration> ahead;  // yielded by the search and not yet taken
        std::size_t compared = 0;         // since one was taken
        const auto look_further = [&] {
            const auto found = search.next();
            if (found && ++compared <= most_compared) {
                ahead.push_back(*found);
                return true;
            }
            return false;
        };
        for (std::uint32_t chosen = 0; chosen < select && per_material > 0;) {
            std::erase_if(ahead, [&](const Configuration& c) {
                return !participation.open(c.left) || !participation.open(c.right);
            });
            if (ahead.empty() && !look_further()) {
                break;
            }
            const Configuration taken = ahead.front();
            ahead.pop_front();
            const PairPlace left = places(taken.left);
            const PairPlace right = places(taken.right);
            want(taken);
            if (!is_certain(left, right)) {
                continue;  // it may not be one that can be taken
            }
            // Whatever could come before it.
            const double greatest = agreement(left.greatest_first, right.least_first,
                                              left.least_second, right.greatest_second);
            if (greatest > taken.agreement) {
                while ((ahead.empty() || ahead.back().agreement <= greatest) && look_further()) {
                }
                for (const auto& other : ahead) {
                    if (other.agreement <= greatest) {
                        want(other);
                    }
                }
            }
            participation.take(taken, search);
            ++chosen;
            compared = 0;
        }
        return wanted_;
    }

  private:
    struct Interval {
        double least;
        double greatest;
    };

    static Interval interval(const Column& column, std::uint32_t pair,
                             const std::vector<bool>& exact) {
        if (exact[pair]) {
            return {column.values[pair], column.values[pair]};
        }
        return {std::max(0.0, column.lower(pair)),
                std::min(std::numeric_limits<double>::max(), column.upper(pair))};
    }

    /// Whether two pairs are a disagreement wherever in their places they are.
    static bool is_certain(const PairPlace& left, const PairPlace& right) {
        const bool less_first = left.greatest_first < right.least_first;
        const bool more_second = left.least_second > right.greatest_second;
        const bool same_first =
            left.least_first == right.greatest_first && left.greatest_first == right.least_first;
        const bool same_second = left.least_second == right.greatest_second &&
                                 left.greatest_second == right.least_second;
        return (less_first && (more_second || same_second)) || (same_first && more_second);
    }

    void want(const Configuration& c) {
        wanted_[c.left] = true;
        wanted_[c.right] = true;
    }

    const Distances& distances_;
    Column first_;
    Column second_;
    std::vector<bool> wanted_;
};

/// The pairs with a distance of which next to nothing is known: they are no help in finding the
/// selection.
std::vector<bool> find_unknown(const Column& first, const Column& second, Decided decided) {
    std::vector<bool> unknown(first.values.size());
    for (std::uint32_t pair = 0; pair < unknown.size(); ++pair) {
        unknown[pair] =
            decided == Decided::selection
                ? !std::isfinite(first.bound(pair)) || !std::isfinite(second.bound(pair))
                : is_loose(first.values[pair], first.bound(pair)) ||
                      is_loose(second.values[pair], second.bound(pair));
    }
    return unknown;
}

/// The inexact distances of pairs that are wanted.
std::vector<std::uint32_t> inexact(const Column& column, const std::vector<bool>& meeting,
                                   const std::vector<bool>& selected) {
    const auto is_wanted = [&](std::uint32_t pair) {
        return column.bound(pair) > 0 && (meeting[pair] || selected[pair]);
    };
    std::vector<std::uint32_t> found;
    std::size_t count = 0;
    for (std::uint32_t pair = 0; pair < column.values.size(); ++pair) {
        count += is_wanted(pair) ? 1 : 0;
    }
    found.reserve(count);
    for (std::uint32_t pair = 0; pair < column.values.size(); ++pair) {
        if (is_wanted(pair)) {
            found.push_back(pair);
        }
    }
    return found;
}

}  // namespace

std::vector<bool> find_meeting(std::span<const double> values, std::span<const double> bounds) {
    return find_meeting(Column{values, bounds}, {});
}

Refinement to_refine(const Distances& distances, std::uint32_t select, std::uint32_t per_material,
                     Decided decided, const Progress& progress) {
    distances.validate();
    const auto column = [](const auto& values, const auto& bounds, bool is_final) {
        return Column{values, is_final ? std::span<const double>() : std::span(bounds)};
    };
    const Column first = column(distances.first, distances.first_bounds, distances.first_is_final);
    const Column second =
        column(distances.second, distances.second_bounds, distances.second_is_final);
    std::vector<bool> first_meeting(distances.pairs());
    std::vector<bool> second_meeting(distances.pairs());
    if (decided == Decided::count_and_selection) {
        first_meeting = find_meeting(first, part_of(progress, 0, 0.25));
        second_meeting = find_meeting(second, part_of(progress, 0.25, 0.25));
    }
    const auto open = [](const std::vector<bool>& meeting) {
        return static_cast<std::uint64_t>(std::ranges::count(meeting, true));
    };
    if ((open(first_meeting) + open(second_meeting)) * kShareToWaitFor >= distances.pairs()) {
        const std::vector<bool> none(distances.pairs());
        return {inexact(first, first_meeting, none), inexact(second, second_meeting, none)};
    }
    const auto selected =
        SelectionDoubts(distances, first, second, find_unknown(first, second, decided))
            .find(select, per_material, part_of(progress, 0.5, 0.5));
    return {inexact(first, first_meeting, selected), inexact(second, second_meeting, selected)};
}

std::vector<OpenConfiguration> list_undecided(const Distances& distances, std::size_t most,
                                              const Progress& progress) {
    distances.validate();
    std::vector<OpenConfiguration> open;
    const auto add_open = [&](const Column& column, const std::string& metric) {
        const auto& values = column.values;
        const auto order = by_lower_end(column, progress);
        // The next place with another value: what ties is passed over at once, however much it is.
        const auto size = static_cast<std::uint32_t>(order.size());
        std::vector<std::uint32_t> next(size, size);
        for (std::uint32_t i = size; i-- > 1;) {
            next[i - 1] = values[order[i - 1].pair] == values[order[i].pair] ? next[i] : i;
        }
        for (std::uint32_t i = 0; i < size && open.size() < most; ++i) {
            const std::uint32_t one = order[i].pair;
            for (std::uint32_t j = i + 1; j < size && open.size() < most;) {
                const auto [lower, other] = order[j];
                if (values[one] == values[other]) {
                    j = next[j];
                } else if (lower <= column.upper(one)) {
                    open.push_back({std::min(one, other), std::max(one, other), metric});
                    ++j;
                } else {
                    break;
                }
            }
        }
    };
    if (distances.first_is_final) {
        add_open({distances.first, distances.first_bounds}, distances.first_metric);
    }
    if (distances.second_is_final) {
        add_open({distances.second, distances.second_bounds}, distances.second_metric);
    }
    return open;
}

}  // namespace merl::scan
