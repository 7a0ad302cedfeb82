#include "scan/select/disagreements.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <cstddef>
#include <functional>
#include <numeric>
#include <stdexcept>

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

/// Calls `of_row` for every pair, on all threads.
void for_each_row(std::uint32_t pairs, const Progress& progress,
                  const std::function<void(std::uint32_t pair)>& of_row) {
    Work work(static_cast<double>(configuration_count(pairs)), progress);
    tbb::parallel_for(std::uint32_t{0}, pairs, [&](std::uint32_t pair) {
        of_row(pair);
        work.add(pairs - pair - 1);
    });
    if (progress) {
        progress(1);
    }
}

}  // namespace

std::vector<Configuration> all_disagreements(const Distances& distances, const Progress& progress) {
    require_listable(count_by_inversions(distances, part_of(progress, 0, 0)).disagreements());

    // Each row of configurations (a, b > a) gets its own place in the list, so that rows can be
    // filled in any order and nothing grows.
    const std::uint32_t pairs = distances.pairs();
    std::vector<std::size_t> ends(pairs);
    for_each_row(pairs, part_of(progress, 0, 0.1), [&](std::uint32_t a) {
        std::size_t found = 0;
        for (std::uint32_t b = a + 1; b < pairs; ++b) {
            found += disagree_on(distances, a, b) ? 1 : 0;
        }
        ends[a] = found;
    });
    std::inclusive_scan(ends.begin(), ends.end(), ends.begin());

    std::vector<Configuration> list(ends.back());
    for_each_row(pairs, part_of(progress, 0.1, 0.2), [&](std::uint32_t a) {
        std::size_t place = a == 0 ? 0 : ends[a - 1];
        for (std::uint32_t b = a + 1; b < pairs; ++b) {
            if (disagree_on(distances, a, b)) {
                list[place++] = make_configuration(distances, a, b);
            }
        }
    });
    sort_with_progress(list, StrongerFirst(), part_of(progress, 0.3, 0.7));
    return list;
}

std::vector<Configuration> strongest_disagreements(const Distances& distances, std::uint64_t count,
                                                   const Progress& progress) {
    if (count == 0) {
        distances.validate();
        return {};
    }
    const std::uint64_t total =
        count_by_inversions(distances, part_of(progress, 0, 0.1)).disagreements();
    const std::uint64_t wanted = std::min(count, total);
    require_listable(wanted);
    // Measured: this is where looking at every configuration begins to pay, and sooner where none
    // is sorted in vain.
    const std::uint64_t each = wanted == total ? 4096 : 16;
    if (total <= max_listed && wanted > distances.configurations() / each) {
        std::vector<Configuration> list = all_disagreements(distances, part_of(progress, 0.1, 0.9));
        list.resize(wanted);
        return list;
    }
    std::vector<Configuration> list;
    list.reserve(wanted);
    // The search tells that it is at work, but not how far it is.
    double reached = 0;
    const auto growing = !progress ? Progress() : [&](double share) {
        reached = std::max(reached, share);
        progress(reached);
    };
    DisagreementSearch search(distances, part_of(growing, 0.1, 0.2));
    const auto of_searching = part_of(growing, 0.3, 0.7);
    Work work(static_cast<double>(wanted), of_searching);
    while (list.size() < wanted) {
        const auto found = search.next();
        if (!found) {
            throw std::logic_error(
                fmt::format("internal error: found {} of {} disagreements", list.size(), total));
        }
        list.push_back(*found);
        work.add_one();
    }
    return list;
}

}  // namespace merl::scan
