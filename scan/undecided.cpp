#include "scan/undecided.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <limits>
#include <numeric>
#include <span>
#include <stdexcept>
#include <utility>

#include "scan/participation.h"
#include "scan/search.h"

namespace merl::scan {
namespace {

/// Beyond this relative bound a distance is refined before it is compared: it would be contested
/// with everything.
constexpr double loose = 1e-3;

/// Relative error of an agreement computed from four exact distances, with room.
constexpr double rounding = 1e-15;

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

/// A bound relative to the least that the exact distance can be.
double relative(double bound, double value) {
    return bound == 0 ? 0 : bound / std::max(value - bound, bound * 1e-6);
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

/// The inexact distances whose interval meets another one's, but of those that are met only by
/// loose ones just these: once they are exact, few are likely to be left.
std::vector<bool> find_meeting(std::span<const double> values, std::span<const double> bounds) {
    std::vector<bool> meeting(values.size());
    auto order = by_lower_end(values, bounds);
    const auto is_loose = [&](std::uint32_t pair) {
        return !(relative(bounds[pair], values[pair]) <= loose);  // or no number: infinite
    };
    add_meeting(values, bounds, order, is_loose, meeting);
    std::erase_if(order, [&](std::uint32_t pair) { return meeting[pair]; });
    add_meeting(
        values, bounds, order, [](std::uint32_t) { return true; }, meeting);
    return meeting;
}

/// What the selection and its order rest on.
class SelectionDoubts {
  public:
    explicit SelectionDoubts(const Distances& distances)
        : distances_(distances), doubt_(distances.pairs()), wanted_(distances.pairs()) {
        for (std::uint32_t pair = 0; pair < distances.pairs(); ++pair) {
            doubt_[pair] = relative(distances.first_bounds[pair], distances.first[pair]) +
                           relative(distances.second_bounds[pair], distances.second[pair]);
            if (!(doubt_[pair] <= loose)) {  // or no number, from an infinite bound
                wanted_[pair] = true;
                doubt_[pair] = 0;  // asked for already, and so not compared this time
            }
            worst_ = std::max(worst_, doubt_[pair]);
        }
    }

    std::vector<bool> find(std::uint32_t select, std::uint32_t per_material) {
        if (worst_ == 0) {
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
                   (ahead.empty() || ahead.back().agreement * (1 - 2.02 * worst_ - rounding) <=
                                         greatest(ahead.front()))) {
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
                if (other.agreement * (1 - doubt(other)) <= greatest(taken)) {
                    want(other);
                }
            }
            participation.take(taken, search);
            ++chosen;
        }
        return wanted_;
    }

  private:
    /// Relative doubt of a configuration's agreement, to first order and with room for the second.
    double doubt(const Configuration& c) const {
        return 1.01 * (doubt_[c.left] + doubt_[c.right]) + rounding;
    }
    double greatest(const Configuration& c) const { return c.agreement * (1 + doubt(c)); }

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
    std::vector<double> doubt_;  // per pair: the relative bounds of its two distances together
    std::vector<bool> wanted_;
    double worst_ = 0;
};

}  // namespace

Refinement to_refine(const Distances& distances, std::uint32_t select, std::uint32_t per_material) {
    distances.validate();
    if (distances.first_bounds.empty() || distances.second_bounds.empty()) {
        throw std::invalid_argument("refinement needs the bounds of both metrics");
    }
    const auto first = find_meeting(distances.first, distances.first_bounds);
    const auto second = find_meeting(distances.second, distances.second_bounds);
    const auto selected = SelectionDoubts(distances).find(select, per_material);
    Refinement result;
    for (std::uint32_t pair = 0; pair < distances.pairs(); ++pair) {
        if (distances.first_bounds[pair] > 0 && (first[pair] || selected[pair])) {
            result.first.push_back(pair);
        }
        if (distances.second_bounds[pair] > 0 && (second[pair] || selected[pair])) {
            result.second.push_back(pair);
        }
    }
    return result;
}

std::uint64_t count_undecided(const Distances& distances) {
    distances.validate();
    if (distances.first_bounds.empty() || distances.second_bounds.empty()) {
        return 0;
    }
    const auto unknown = [](std::span<const double> bounds) {
        return std::all_of(bounds.begin(), bounds.end(), [](double b) { return std::isinf(b); });
    };
    if (unknown(distances.first_bounds) || unknown(distances.second_bounds)) {
        return distances.configurations();  // one by one that is 10^11 for 1,000 materials
    }
    // Calls `found` for every configuration whose two intervals meet and are not both exact.
    const auto each_meeting = [](std::span<const double> values, std::span<const double> bounds,
                                 const auto& found) {
        const auto order = by_lower_end(values, bounds);
        for (std::size_t i = 0; i < order.size(); ++i) {
            for (std::size_t j = i + 1; j < order.size() && lower(values, bounds, order[j]) <=
                                                                upper(values, bounds, order[i]);
                 ++j) {
                if (bounds[order[i]] > 0 || bounds[order[j]] > 0) {
                    found(order[i], order[j]);
                }
            }
        }
    };
    const auto& d = distances;
    std::uint64_t count = 0;
    each_meeting(d.first, d.first_bounds, [&](std::uint32_t, std::uint32_t) { ++count; });
    each_meeting(d.second, d.second_bounds, [&](std::uint32_t a, std::uint32_t b) {
        const bool counted =
            lower(d.first, d.first_bounds, a) <= upper(d.first, d.first_bounds, b) &&
            lower(d.first, d.first_bounds, b) <= upper(d.first, d.first_bounds, a) &&
            (d.first_bounds[a] > 0 || d.first_bounds[b] > 0);
        count += counted ? 0 : 1;
    });
    return count;
}

}  // namespace merl::scan
