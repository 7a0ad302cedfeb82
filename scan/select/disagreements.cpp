#include "scan/select/disagreements.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "scan/pairs/count.h"
#include "scan/select/disagreement_search.h"

namespace merl::scan {
namespace {

bool disagree_on(const Distances& d, std::size_t a, std::size_t b) {
    return disagree(d.first[a], d.first[b], d.second[a], d.second[b]);
}

void require_listable(std::uint64_t count) {
    if (count > max_listed) {
        throw std::length_error(
            fmt::format("{} disagreements are too many to list: expected {} or fewer; ask for the "
                        "strongest of them",
                        count, max_listed));
    }
}

using Progress = std::function<void(double share)>;

/// Rows that are gone through before progress is called: tenths of a second.
constexpr std::uint64_t configurations_at_a_time = 1U << 27U;

/// Calls `of_row` for every pair, on all threads, and `progress` now and then.
void for_each_row(std::uint32_t pairs, const Progress& progress,
                  const std::function<void(std::uint32_t pair)>& of_row) {
    const auto at_a_time =
        static_cast<std::uint32_t>(std::max<std::uint64_t>(1, configurations_at_a_time / pairs));
    for (std::uint32_t begin = 0; begin < pairs;) {
        const std::uint32_t end = begin + std::min(at_a_time, pairs - begin);
        tbb::parallel_for(begin, end, of_row);
        begin = end;
        progress(static_cast<double>(begin) / pairs);
    }
}

/// StrongerFirst, which on the thread that made it calls progress now and then: sorting ends with
/// what that throws.
class SortProgress {
  public:
    SortProgress(std::size_t size, const Progress& progress)
        : expected_(1.2 * static_cast<double>(size) * std::log2(static_cast<double>(size) + 2)),
          progress_(progress) {}

    void compared() {
        thread_local std::uint32_t count = 0;
        if (++count % comparisons_at_a_time == 0) {
            const auto done = total_ += comparisons_at_a_time;
            if (std::this_thread::get_id() == owner_) {
                progress_(std::min(1.0, static_cast<double>(done) / expected_));
            }
        }
    }

  private:
    static constexpr std::uint32_t comparisons_at_a_time = 1U << 18U;
    double expected_;
    const Progress& progress_;
    std::thread::id owner_ = std::this_thread::get_id();
    std::atomic<std::uint64_t> total_ = 0;
};

}  // namespace

std::vector<Configuration> all_disagreements(const Distances& distances, const Progress& progress) {
    const auto part = [&](double begin, double length) {
        return [&progress, begin, length](double share) {
            if (progress) {
                progress(begin + length * share);
            }
        };
    };
    require_listable(count_by_inversions(distances).disagreements());

    // Each row of configurations (a, b > a) gets its own place in the list, so that rows can be
    // filled in any order and nothing grows.
    const std::uint32_t pairs = distances.pairs();
    std::vector<std::size_t> ends(pairs);
    for_each_row(pairs, part(0, 0.1), [&](std::uint32_t a) {
        std::size_t found = 0;
        for (std::uint32_t b = a + 1; b < pairs; ++b) {
            found += disagree_on(distances, a, b) ? 1 : 0;
        }
        ends[a] = found;
    });
    std::inclusive_scan(ends.begin(), ends.end(), ends.begin());

    std::vector<Configuration> list(ends.back());
    for_each_row(pairs, part(0.1, 0.2), [&](std::uint32_t a) {
        std::size_t place = a == 0 ? 0 : ends[a - 1];
        for (std::uint32_t b = a + 1; b < pairs; ++b) {
            if (disagree_on(distances, a, b)) {
                list[place++] = make_configuration(distances, a, b);
            }
        }
    });
    const Progress of_sorting = part(0.3, 0.7);
    SortProgress sorting(list.size(), of_sorting);
    tbb::parallel_sort(list, [&](const Configuration& x, const Configuration& y) {
        sorting.compared();
        return StrongerFirst()(x, y);
    });
    return list;
}

std::vector<Configuration> strongest_disagreements(const Distances& distances, std::uint64_t count,
                                                   const Progress& progress) {
    const std::uint64_t total = count_by_inversions(distances).disagreements();
    const std::uint64_t wanted = std::min(count, total);
    require_listable(wanted);
    // Measured: this is where looking at every configuration begins to pay.
    if (total <= max_listed && wanted > distances.configurations() / 16) {
        std::vector<Configuration> list = all_disagreements(distances, progress);
        list.resize(wanted);
        return list;
    }
    std::vector<Configuration> list;
    list.reserve(wanted);
    DisagreementSearch search(distances);
    while (list.size() < wanted) {
        const auto found = search.next();
        if (!found) {
            throw std::logic_error(
                fmt::format("internal error: found {} of {} disagreements", list.size(), total));
        }
        list.push_back(*found);
        if (progress && list.size() % 4096 == 0) {
            progress(static_cast<double>(list.size()) / static_cast<double>(wanted));
        }
    }
    return list;
}

}  // namespace merl::scan
