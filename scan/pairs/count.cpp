#include "scan/pairs/count.h"

#include <fmt/format.h>
#include <tbb/blocked_range.h>
#include <tbb/parallel_reduce.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <stdexcept>
#include <vector>

#include "engine/base/widest_vectors.h"
#include "scan/pairs/merge_count.h"

namespace merl::scan {
namespace {

/// Sums over configurations; a tie in both metrics counts in all three kinds of tie.
struct Tally {
    std::uint64_t disagreements = 0;
    std::uint64_t tied_first = 0;
    std::uint64_t tied_second = 0;
    std::uint64_t tied_both = 0;

    Tally operator+(const Tally& other) const {
        return {disagreements + other.disagreements, tied_first + other.tied_first,
                tied_second + other.tied_second, tied_both + other.tied_both};
    }
};

Counts classify(const Tally& tally, std::uint64_t configurations) {
    const std::uint64_t tied_first_only = tally.tied_first - tally.tied_both;
    const std::uint64_t tied_second_only = tally.tied_second - tally.tied_both;
    return {configurations, tally.disagreements - tied_first_only - tied_second_only,
            tied_first_only, tied_second_only, tally.tied_both};
}

/// The configurations of one pair with `count` others.
MERL_SCAN_WIDEST_VECTORS
Tally tally_row(double d1, double d2, const double* first, const double* second,
                std::size_t count) {
    Tally tally;
    for (std::size_t b = 0; b < count; ++b) {
        // Without a branch, and in 64-bit integers as wide as the distances, so that it vectorises.
        const std::uint64_t less_1 = d1 < first[b] ? 1 : 0;
        const std::uint64_t less_2 = d2 < second[b] ? 1 : 0;
        const std::uint64_t greater_1 = d1 > first[b] ? 1 : 0;
        const std::uint64_t greater_2 = d2 > second[b] ? 1 : 0;
        const std::uint64_t equal_1 = 1 ^ (less_1 | greater_1);
        const std::uint64_t equal_2 = 1 ^ (less_2 | greater_2);
        tally.disagreements += (less_1 ^ less_2) | (greater_1 ^ greater_2);
        tally.tied_first += equal_1;
        tally.tied_second += equal_2;
        tally.tied_both += equal_1 & equal_2;
    }
    return tally;
}

/// A pair of materials as its two distances.
struct Point {
    double first;
    double second;
};

bool operator<(const Point& a, const Point& b) {
    return a.first < b.first || (a.first == b.first && a.second < b.second);
}

/// Number of pairs of equal elements in a sorted range, that is the sum of t(t-1)/2 over its runs.
template <typename Range, typename Equal>
std::uint64_t count_ties(const Range& sorted, Equal equal) {
    std::uint64_t ties = 0;
    std::uint64_t run = 0;
    for (std::size_t i = 1; i < sorted.size(); ++i) {
        run = equal(sorted[i - 1], sorted[i]) ? run + 1 : 0;
        ties += run;
    }
    return ties;
}

}  // namespace

Counts count_by_streaming(const DistancesView& distances, const Progress& progress) {
    distances.validate();
    const std::size_t pairs = distances.pairs();
    const double* first = distances.first.data();
    const double* second = distances.second.data();
    Work work(static_cast<double>(distances.configurations()), progress);
    const Tally tally = tbb::parallel_reduce(
        tbb::blocked_range<std::size_t>(0, pairs, 16), Tally(),
        [=, &work](const tbb::blocked_range<std::size_t>& rows, Tally sum) {
            for (std::size_t a = rows.begin(); a < rows.end(); ++a) {
                sum = sum +
                      tally_row(first[a], second[a], first + a + 1, second + a + 1, pairs - a - 1);
                work.add(pairs - a - 1);
            }
            return sum;
        },
        std::plus<>());
    return classify(tally, distances.configurations());
}

Counts count_by_inversions(const DistancesView& distances, const Progress& progress) {
    distances.validate();
    std::vector<Point> points(distances.pairs());
    const auto filling = part_of(progress, 0, 0.05);
    Work work(static_cast<double>(points.size()), filling);
    in_parallel(points.size(), work, [&](std::uint32_t begin, std::uint32_t end) {
        for (std::uint32_t i = begin; i < end; ++i) {
            points[i] = {distances.first[i], distances.second[i]};
        }
    });
    sort_with_progress(points, std::less<>(), part_of(progress, 0.05, 0.65));

    Counts counts;
    counts.configurations = distances.configurations();
    counts.tied_both = count_ties(points, [](const Point& a, const Point& b) {
        return a.first == b.first && a.second == b.second;
    });
    counts.tied_first_only =
        count_ties(points, [](const Point& a, const Point& b) { return a.first == b.first; }) -
        counts.tied_both;
    // Within a tie of the first metric the second ascends, so that a tie adds no inversion.
    std::vector<double> second(points.size());
    std::ranges::transform(points, second.begin(), &Point::second);
    std::vector<Point>().swap(points);  // there may be fifty million
    counts.discordant = count_inversions<double>(second, part_of(progress, 0.7, 0.3));
    counts.tied_second_only = count_ties(second, std::equal_to<>()) - counts.tied_both;
    return counts;
}

Census count_disagreements(const DistancesView& distances, const Progress& progress) {
    const bool stream = distances.configurations() <= max_streamed;
    const Counts counts = count_by_inversions(distances, part_of(progress, 0, stream ? 0.2 : 1.0));
    if (!stream) {
        return {counts, false};
    }
    const Counts streamed = count_by_streaming(distances, part_of(progress, 0.2, 0.8));
    if (streamed != counts) {
        throw std::logic_error(fmt::format(
            "internal error: streaming counts {} disagreements where the inversions give {}",
            streamed.disagreements(), counts.disagreements()));
    }
    return {counts, true};
}

}  // namespace merl::scan
