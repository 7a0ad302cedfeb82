#pragma once

#include <tbb/blocked_range.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <utility>

namespace merl::scan {

/// Is called with the share of some work that is done, from 0 to 1, one call at a time, on any
/// thread. What it throws ends the work and comes out.
using Progress = std::function<void(double share)>;

/// The progress of a part of some work: of `length`, from `begin` on. `progress` may be empty.
inline Progress part_of(Progress progress, double begin, double length) {
    if (!progress) {
        return {};
    }
    return [progress = std::move(progress), begin, length](double share) {
        progress(begin + length * share);
    };
}

/// Work that is done in many small units on any number of threads. It calls a progress function
/// every 50 ms, so that it can be ended soon however long it takes.
class Work {
  public:
    /// `units` may be a guess: what goes beyond stays at the end. `progress` must outlive this.
    Work(double units, const Progress& progress) : units_(units), progress_(progress) {}

    /// So many units more are done; to be called every few milliseconds at least.
    void add(std::uint64_t units) {
        if (!progress_) {
            return;
        }
        done_ += units;
        const auto now = std::chrono::steady_clock::now();
        const std::unique_lock lock(mutex_, std::try_to_lock);
        if (lock.owns_lock() && now - last_ >= std::chrono::milliseconds(50)) {
            last_ = now;
            progress_(std::min(1.0, static_cast<double>(done_) / units_));
        }
    }

    /// One unit more, of those that are too small to be added one by one.
    void add_one() {
        constexpr std::uint32_t at_a_time = 1U << 16U;
        thread_local std::uint32_t count = 0;
        if (++count % at_a_time == 0) {
            add(at_a_time);
        }
    }

  private:
    double units_;
    const Progress& progress_;
    std::atomic<std::uint64_t> done_ = 0;
    std::mutex mutex_;
    std::chrono::steady_clock::time_point last_;  // long ago: the first units are told at once
};

/// Calls `of_range(begin, end)` for ranges of 0 to `size`, on the threads of the caller's arena.
template <typename OfRange>
void in_parallel(std::size_t size, Work& work, const OfRange& of_range) {
    tbb::parallel_for(tbb::blocked_range<std::size_t>(0, size, 1U << 14U), [&](const auto& range) {
        of_range(static_cast<std::uint32_t>(range.begin()),
                 static_cast<std::uint32_t>(range.end()));
        work.add(range.size());
    });
}

/// The same one range after the other, on this thread.
template <typename OfRange>
void in_pieces(std::size_t size, Work& work, const OfRange& of_range) {
    constexpr std::size_t piece = 1U << 18U;
    for (std::size_t begin = 0; begin < size; begin += piece) {
        const std::size_t end = std::min(begin + piece, size);
        of_range(static_cast<std::uint32_t>(begin), static_cast<std::uint32_t>(end));
        work.add(end - begin);
    }
}

/// Comparisons of a sort of so many things, about.
inline double sort_units(std::size_t size) {
    return 1.2 * static_cast<double>(size) * std::log2(static_cast<double>(size) + 2);
}

/// Sorts in place on the threads of the caller's arena; things that are equal in any order.
template <typename Range, typename Less>
void sort_with_progress(Range& range, const Less& less, const Progress& progress) {
    Work work(sort_units(range.size()), progress);
    tbb::parallel_sort(range.begin(), range.end(), [&](const auto& a, const auto& b) {
        work.add_one();
        return less(a, b);
    });
}

}  // namespace merl::scan
