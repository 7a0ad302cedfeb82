#pragma once

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
