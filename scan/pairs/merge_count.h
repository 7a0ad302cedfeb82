#pragma once

#include <tbb/parallel_invoke.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "scan/pairs/work.h"

namespace merl::scan {

/// Sorts numbers by merging and counts inversions meanwhile: how often a number of which
/// `is_left()` is true comes, before they are sorted, before a smaller one of which `is_right()` is
/// true (W. R. Knight, "A Computer Method for Calculating Kendall's Tau with Ungrouped Data", JASA
/// 61, 1966). O(n log n), on the threads of the caller's arena, with as much memory again.
template <typename Number, typename IsLeft, typename IsRight>
class InversionCount {
  public:
    InversionCount(IsLeft is_left, IsRight is_right) : is_left_(is_left), is_right_(is_right) {}

    std::uint64_t sort(std::span<Number> numbers, const Progress& progress) const {
        std::vector<Number> room(numbers.size());
        double levels = 1;
        for (std::size_t size = numbers.size(); size > 1; size /= 2) {
            ++levels;
        }
        Work work(levels * static_cast<double>(numbers.size()), progress);
        return sort(numbers, room, work);
    }

  private:
    /// So many fit into a cache, and their merges are too short to be shared between threads.
    static constexpr std::size_t chunk = 1U << 15U;

    /// Steps between two looks at the clock: milliseconds.
    static constexpr std::size_t piece = 1U << 19U;

    std::uint64_t sort(std::span<Number> numbers, std::span<Number> room, Work& work) const {
        const std::size_t size = numbers.size();
        if (size <= chunk) {
            return sort_chunk(numbers, room, work);
        }
        const std::size_t middle = size / 2;
        std::uint64_t of_left = 0;
        std::uint64_t of_right = 0;
        tbb::parallel_invoke(
            [&] { of_left = sort(numbers.first(middle), room.first(middle), work); },
            [&] { of_right = sort(numbers.subspan(middle), room.subspan(middle), work); });
        const std::uint64_t between = merge(numbers, middle, room, &work);
        std::ranges::copy(room, numbers.begin());
        return of_left + of_right + between;
    }

    std::uint64_t sort_chunk(std::span<Number> numbers, std::span<Number> room, Work& work) const {
        const std::size_t size = numbers.size();
        std::uint64_t count = 0;
        auto from = numbers;
        auto to = room;
        for (std::size_t width = 1; width < size; width *= 2) {
            for (std::size_t begin = 0; begin < size; begin += 2 * width) {
                const std::size_t length = std::min(2 * width, size - begin);
                count += merge(from.subspan(begin, length), std::min(width, length),
                               to.subspan(begin, length), nullptr);
            }
            std::swap(from, to);
            work.add(size);
        }
        if (from.data() != numbers.data()) {
            std::ranges::copy(from, numbers.begin());
        }
        return count;
    }

    /// Merges the two sorted halves of `from`; returns the inversions between them.
    std::uint64_t merge(std::span<const Number> from, std::size_t middle, std::span<Number> to,
                        Work* work) const {
        std::uint64_t count = 0;
        std::size_t left = 0;
        std::size_t right = middle;
        std::size_t out = 0;
        std::uint64_t waiting = 0;  // of the left half, those that count
        for (std::size_t i = 0; i < middle; ++i) {
            waiting += is_left_(from[i]) ? 1 : 0;
        }
        while (left < middle && right < from.size()) {
            const std::size_t end = out + std::min({piece, middle - left, from.size() - right});
            const std::size_t begin = out;
            while (out < end) {
                // No branch on the data: it would be mispredicted every other time.
                const Number one = from[left];
                const Number other = from[right];
                const bool take_right = other < one;
                to[out++] = take_right ? other : one;
                count += take_right && is_right_(other) ? waiting : 0;
                waiting -= !take_right && is_left_(one) ? 1 : 0;
                right += take_right ? 1 : 0;
                left += take_right ? 0 : 1;
            }
            if (work != nullptr) {
                work->add(out - begin);
            }
        }
        const auto rest = std::ranges::copy(from.subspan(left, middle - left),
                                            to.begin() + static_cast<std::ptrdiff_t>(out))
                              .out;
        std::ranges::copy(from.subspan(right), rest);
        return count;
    }

    IsLeft is_left_;
    IsRight is_right_;
};

/// Sorts numbers and returns how many pairs of them were in strictly descending order.
template <typename Number>
std::uint64_t count_inversions(std::span<Number> numbers, const Progress& progress) {
    const auto all = [](Number) { return true; };
    return InversionCount<Number, decltype(all), decltype(all)>(all, all).sort(numbers, progress);
}

}  // namespace merl::scan
