#include "scan/disagreements.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <stdexcept>

#include "scan/count.h"
#include "scan/search.h"

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

}  // namespace

std::vector<Configuration> all_disagreements(const Distances& distances) {
    require_listable(count_by_inversions(distances).disagreements());

    // Each row of configurations (a, b > a) gets its own place in the list, so that rows can be
    // filled in any order and nothing grows.
    const std::uint32_t pairs = distances.pairs();
    std::vector<std::size_t> ends(pairs);
    tbb::parallel_for(std::uint32_t{0}, pairs, [&](std::uint32_t a) {
        std::size_t found = 0;
        for (std::uint32_t b = a + 1; b < pairs; ++b) {
            found += disagree_on(distances, a, b) ? 1 : 0;
        }
        ends[a] = found;
    });
    std::inclusive_scan(ends.begin(), ends.end(), ends.begin());

    std::vector<Configuration> list(ends.back());
    tbb::parallel_for(std::uint32_t{0}, pairs, [&](std::uint32_t a) {
        std::size_t place = a == 0 ? 0 : ends[a - 1];
        for (std::uint32_t b = a + 1; b < pairs; ++b) {
            if (disagree_on(distances, a, b)) {
                list[place++] = make_configuration(distances, a, b);
            }
        }
    });
    tbb::parallel_sort(list, StrongerFirst());
    return list;
}

std::vector<Configuration> strongest_disagreements(const Distances& distances,
                                                   std::uint64_t count) {
    const std::uint64_t total = count_by_inversions(distances).disagreements();
    const std::uint64_t wanted = std::min(count, total);
    require_listable(wanted);
    // Measured: this is where looking at every configuration begins to pay.
    if (total <= max_listed && wanted > distances.configurations() / 16) {
        std::vector<Configuration> list = all_disagreements(distances);
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
    }
    return list;
}

}  // namespace merl::scan
