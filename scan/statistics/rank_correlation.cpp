#include "scan/statistics/rank_correlation.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
#include <numeric>

namespace merl::scan {
namespace {

/// Indices by ascending value.
std::vector<std::size_t> order_of(std::span<const double> x) {
    std::vector<std::size_t> order(x.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::ranges::sort(order, {}, [&](std::size_t i) { return x[i]; });
    return order;
}

/// Calls `group` with each run of indices whose values are equal.
template <typename Group>
void for_each_group(std::span<const double> x, std::span<const std::size_t> order,
                    const Group& group) {
    for (std::size_t begin = 0; begin < order.size();) {
        std::size_t end = begin + 1;
        while (end < order.size() && x[order[end]] == x[order[begin]]) {
            ++end;
        }
        group(order.subspan(begin, end - begin));
        begin = end;
    }
}

/// For each k the sum of values[i] with x[i] above x[k], less that with x[i] below.
std::vector<double> above_minus_below(std::span<const double> x, std::span<const double> values) {
    const auto order = order_of(x);
    const double all = std::accumulate(values.begin(), values.end(), 0.0);
    std::vector<double> result(x.size());
    double below = 0;
    for_each_group(x, order, [&](std::span<const std::size_t> group) {
        double equal = 0;
        for (const auto i : group) {
            equal += values[i];
        }
        for (const auto k : group) {
            result[k] = all - below - equal - below;
        }
        below += equal;
    });
    return result;
}

/// Ranks, from the middle one: multiples of 1/2, so exact.
std::vector<double> centred_ranks(std::span<const double> x) {
    auto ranks = above_minus_below(x, std::vector<double>(x.size(), 1));
    for (double& rank : ranks) {
        rank /= -2;
    }
    return ranks;
}

double product(std::span<const double> a, std::span<const double> b) {
    return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// The figure c / sqrt(a b), and its derivatives from those of its parts.
RankCorrelation normalised(double c, double a, double b, std::span<const double> dc,
                           std::span<const double> da, std::span<const double> db) {
    RankCorrelation result{std::numeric_limits<double>::quiet_NaN(),
                           std::vector<double>(dc.size())};
    if (!(a > 0 && b > 0)) {
        return result;
    }
    const double scale = std::sqrt(a * b);  // exactly a where a is b
    result.value = std::clamp(c / scale, -1.0, 1.0);
    for (std::size_t k = 0; k < dc.size(); ++k) {
        result.influences[k] = dc[k] / scale - result.value / 2 * (da[k] / a + db[k] / b);
    }
    return result;
}

/// Counts of numbered things that were added.
class Counter {  // a Fenwick tree
  public:
    explicit Counter(std::size_t numbers) : sums_(numbers + 1) {}

    void add(std::size_t number) {
        for (++number; number < sums_.size(); number += number & (0 - number)) {
            ++sums_[number];
        }
    }

    /// How many have a smaller number.
    std::int64_t below(std::size_t number) const {
        std::int64_t sum = 0;
        for (; number > 0; number &= number - 1) {
            sum += sums_[number];
        }
        return sum;
    }

  private:
    std::vector<std::int64_t> sums_;
};

/// For each k the number of i with x[i] < x[k] and y[i] < y[k], less that with x[i] < x[k] and
/// y[i] > y[k].
std::vector<double> concordance_below(std::span<const double> x, std::span<const double> y) {
    std::vector<std::size_t> numbers(y.size());  // of equal y the same
    std::size_t distinct = 0;
    for_each_group(y, order_of(y), [&](std::span<const std::size_t> group) {
        for (const auto i : group) {
            numbers[i] = distinct;
        }
        ++distinct;
    });
    Counter counter(distinct);
    std::int64_t added = 0;
    std::vector<double> result(x.size());
    for_each_group(x, order_of(x), [&](std::span<const std::size_t> group) {
        for (const auto k : group) {
            result[k] = static_cast<double>(counter.below(numbers[k]) -
                                            (added - counter.below(numbers[k] + 1)));
        }
        for (const auto k : group) {
            counter.add(numbers[k]);
        }
        added += static_cast<std::int64_t>(group.size());
    });
    return result;
}

/// For each k how many have another x.
std::vector<double> others(std::span<const double> x) {
    std::vector<double> result(x.size());
    for_each_group(x, order_of(x), [&](std::span<const std::size_t> group) {
        for (const auto k : group) {
            result[k] = static_cast<double>(x.size() - group.size());
        }
    });
    return result;
}

std::vector<double> negative(std::span<const double> x) {
    std::vector<double> result(x.begin(), x.end());
    std::ranges::transform(result, result.begin(), [](double v) { return 0 - v; });
    return result;
}

std::vector<double> twice(std::span<const double> x) {
    std::vector<double> result(x.begin(), x.end());
    std::ranges::transform(result, result.begin(), [](double v) { return 2 * v; });
    return result;
}

double sum(std::span<const double> x) {
    return std::accumulate(x.begin(), x.end(), 0.0);
}

}  // namespace

RankCorrelation spearman(std::span<const double> x, std::span<const double> y) {
    const auto a = centred_ranks(x);
    const auto b = centred_ranks(y);
    // A rank from the middle is half the sum of signs of differences, which are linear in weights.
    const auto b_by_x = above_minus_below(x, b);
    const auto a_by_y = above_minus_below(y, a);
    const auto a_by_x = above_minus_below(x, a);
    const auto b_by_y = above_minus_below(y, b);
    std::vector<double> dc(x.size());
    std::vector<double> da(x.size());
    std::vector<double> db(x.size());
    for (std::size_t k = 0; k < x.size(); ++k) {
        dc[k] = a[k] * b[k] + (b_by_x[k] + a_by_y[k]) / 2;
        da[k] = a[k] * a[k] + a_by_x[k];
        db[k] = b[k] * b[k] + b_by_y[k];
    }
    return normalised(product(a, b), product(a, a), product(b, b), dc, da, db);
}

RankCorrelation kendall(std::span<const double> x, std::span<const double> y) {
    auto c = concordance_below(x, y);
    const auto above = concordance_below(negative(x), negative(y));
    std::ranges::transform(c, above, c.begin(), std::plus());
    const auto a = others(x);
    const auto b = others(y);
    return normalised(sum(c), sum(a), sum(b), twice(c), twice(a), twice(b));
}

}  // namespace merl::scan
