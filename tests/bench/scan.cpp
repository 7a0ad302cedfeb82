#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <numeric>
#include <system_error>
#include <utility>
#include <vector>

#include "app/pipeline/refine.h"
#include "scan/pairs/bounded_count.h"
#include "scan/pairs/count.h"
#include "scan/select/disagreements.h"
#include "scan/select/scan_tables.h"
#include "scan/select/selection.h"
#include "scan/select/undecided.h"
#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"
#include "tests/scan/support.h"

namespace merl::bench {
namespace {

constexpr std::uint32_t kSelect = 100;
constexpr std::uint32_t kPerMaterial = 10;
constexpr std::uint32_t kMany = 1000;

/// The disagreements of the built-in database, by an independent float64 program (tests/data).
constexpr std::uint64_t kGoldenDisagreements = 4'289'737;

const scan::Distances& many_distances() {
    static const auto distances = made_up_distances(kMany);
    return distances;
}

/// The same, each within 3e-7 of itself: what float32 leaves of ordinary materials.
const scan::Distances& many_bounded_distances() {
    static const auto distances = [] {
        auto result = many_distances();
        for (const double distance : result.first) {
            result.first_bounds.push_back(3e-7 * distance);
        }
        for (const double distance : result.second) {
            result.second_bounds.push_back(3e-7 * distance);
        }
        return result;
    }();
    return distances;
}

/// Disagreements of distances without ties, by a Fenwick tree: a third way beside the two of
/// scan/pairs/count.h, and quick enough for 1,000 materials.
std::uint64_t count_by_tree(const scan::Distances& distances) {
    const std::size_t pairs = distances.first.size();
    std::vector<std::size_t> order(pairs);
    std::iota(order.begin(), order.end(), 0);
    auto sorted = distances.second;
    std::ranges::sort(sorted);
    std::ranges::sort(order, {}, [&](std::size_t p) { return distances.first[p]; });
    std::vector<std::uint64_t> tree(pairs + 1);
    std::uint64_t concordant = 0;
    for (const auto p : order) {
        const auto rank = static_cast<std::size_t>(
            std::ranges::lower_bound(sorted, distances.second[p]) - sorted.begin());
        for (auto i = rank; i > 0; i &= i - 1) {
            concordant += tree[i];
        }
        for (auto i = rank + 1; i <= pairs; i += i & (~i + 1)) {
            ++tree[i];
        }
    }
    return distances.configurations() - concordant;
}

void require_count(std::uint64_t found, std::uint64_t expected) {
    require(found == expected, fmt::format("{} disagreements, expected {}", found, expected));
}

void time_refine(benchmark::State& state) {
    check_once("refine", [] {
        require(scan::to_refine(exact_distances(), kSelect, kPerMaterial).empty(), "not refined");
        if (settings().database.empty() && !settings().check) {
            require_count(scan::count_by_inversions(exact_distances()).disagreements(),
                          kGoldenDisagreements);
        }
        return 0;
    });
    pipeline::Refined refined;
    for ([[maybe_unused]] auto _ : state) {
        auto distances = device_distances();
        refined = pipeline::refine(distances, database(), two_metrics(), kSelect, kPerMaterial,
                                   1ULL << 30U, {});
    }
    state.counters["refined"] = static_cast<double>(refined.first + refined.second);
}

template <typename Count>
void time_count(benchmark::State& state, const std::string& name, const scan::Distances& distances,
                const Count& count) {
    check_once(name, [&] {
        require_count(count(distances).disagreements(), count_by_tree(distances));
        return 0;
    });
    for ([[maybe_unused]] auto _ : state) {
        benchmark::DoNotOptimize(count(distances));
    }
    state.counters["configurations"] = static_cast<double>(distances.configurations());
}

void time_bounds(benchmark::State& state) {
    const auto& distances = many_bounded_distances();
    check_once("bounds/of-1000", [&] {
        const auto bounded = scan::bound_disagreements(distances);
        const auto count = count_by_tree(distances);
        require(bounded.undecided > 0 && bounded.least <= count && count <= bounded.greatest(),
                "the count is not within the bounds");
        return 0;
    });
    for ([[maybe_unused]] auto _ : state) {
        benchmark::DoNotOptimize(scan::bound_disagreements(distances));
    }
}

/// Which distances are wanted in float64; those of the selection must be among them, or, where the
/// signs come first because they make many wanted, just those that the signs rest on.
void time_to_refine(benchmark::State& state, const std::string& name, scan::Decided decided) {
    const auto& distances = many_bounded_distances();
    check_once(name, [&] {
        const auto wanted = scan::to_refine(distances, kSelect, kPerMaterial, decided);
        if (decided == scan::Decided::count_and_selection) {
            const auto meeting = scan::find_meeting(distances.first, distances.first_bounds);
            require(std::cmp_equal(wanted.first.size(), std::ranges::count(meeting, true)),
                    "not just what meets another one is wanted");
            return 0;
        }
        for (const auto& c : scan::select_configurations(distances, kSelect, kPerMaterial)) {
            for (const auto* pairs : {&wanted.first, &wanted.second}) {
                require(std::ranges::binary_search(*pairs, c.left) &&
                            std::ranges::binary_search(*pairs, c.right),
                        "a pair of the selection is not wanted");
            }
        }
        return 0;
    });
    std::size_t wanted = 0;
    for ([[maybe_unused]] auto _ : state) {
        const auto found = scan::to_refine(distances, kSelect, kPerMaterial, decided);
        wanted = found.first.size() + found.second.size();
    }
    state.counters["wanted"] = static_cast<double>(wanted);
}

/// The best-first search against a list that is sorted in full, or as far as the selection goes.
void check_selection(const scan::Distances& distances) {
    const bool all = distances.configurations() <= scan::max_listed;
    const auto listed = all ? scan::all_disagreements(distances)
                            : scan::strongest_disagreements(distances, 100ULL * kSelect);
    const auto expected = scan::testing::plain_selection(distances, listed, kSelect, kPerMaterial);
    require(all || expected.size() == kSelect, "the list is too short to select from");
    require(scan::select_configurations(distances, kSelect, kPerMaterial) == expected,
            "the selection is not that of the list");
}

void time_selection(benchmark::State& state, const std::string& name,
                    const scan::Distances& distances) {
    check_once(name, [&] {
        check_selection(distances);
        return 0;
    });
    for ([[maybe_unused]] auto _ : state) {
        benchmark::DoNotOptimize(scan::select_configurations(distances, kSelect, kPerMaterial));
    }
}

/// A file in memory.
class MemoryFile {
  public:
    MemoryFile() : file_(::memfd_create("disagreements.csv", 0)) {
        if (file_ < 0) {
            throw std::system_error(errno, std::generic_category(), "memfd_create");
        }
    }
    ~MemoryFile() { ::close(file_); }
    MemoryFile(const MemoryFile&) = delete;
    MemoryFile& operator=(const MemoryFile&) = delete;

    int descriptor() const { return file_; }
    void clear() const {
        require(::ftruncate(file_, 0) == 0 && ::lseek(file_, 0, SEEK_SET) == 0, "cannot truncate");
    }
    std::string text() const {
        std::string all(static_cast<std::size_t>(::lseek(file_, 0, SEEK_END)), '\0');
        std::size_t read = 0;
        while (read < all.size()) {
            const auto part =
                ::pread(file_, all.data() + read, all.size() - read, static_cast<off_t>(read));
            require(part > 0, "cannot read back");
            read += static_cast<std::size_t>(part);
        }
        return all;
    }

  private:
    int file_;
};

void time_csv(benchmark::State& state) {
    const auto& distances = exact_distances();
    const auto disagreements = scan::all_disagreements(distances);
    const MemoryFile file;
    scan::write_disagreements(file.descriptor(), distances, disagreements);
    const auto bytes = ::lseek(file.descriptor(), 0, SEEK_CUR);
    check_once("csv", [&] {
        const auto text = file.text();
        const auto rows = static_cast<std::size_t>(std::ranges::count(text, '\n'));
        require(rows == disagreements.size() + 1, "not a row a disagreement");
        const auto last = text.substr(text.rfind(',') + 1);
        require(std::stod(last) == disagreements.back().agreement, "the last row is another");
        return 0;
    });
    for ([[maybe_unused]] auto _ : state) {
        state.PauseTiming();
        file.clear();
        state.ResumeTiming();
        scan::write_disagreements(file.descriptor(), distances, disagreements);
    }
    state.SetBytesProcessed(state.iterations() * bytes);
}

void time_list(benchmark::State& state) {
    const auto& distances = exact_distances();
    check_once("list", [&] {
        require_count(scan::all_disagreements(distances).size(), count_by_tree(distances));
        return 0;
    });
    for ([[maybe_unused]] auto _ : state) {
        benchmark::DoNotOptimize(scan::all_disagreements(distances));
    }
}

}  // namespace

void add_scan() {
    using benchmark::State;
    add("refine", time_refine).Iterations(1);
    add("count/streaming", [](State& state) {
        time_count(state, "streaming", exact_distances(), [](const scan::Distances& distances) {
            return scan::count_by_streaming(distances);
        });
    });
    add("count/inversions", [](State& state) {
        time_count(state, "inversions", exact_distances(), [](const scan::Distances& distances) {
            return scan::count_by_inversions(distances);
        });
    });
    add("count/of-1000", [](State& state) {
        require(!scan::count_disagreements(many_distances()).streamed, "streaming was tried");
        time_count(state, "of-1000", many_distances(), [](const scan::Distances& distances) {
            return scan::count_disagreements(distances).counts;
        });
    });
    add("select", [](State& state) { time_selection(state, "select", exact_distances()); });
    add("select/of-1000",
        [](State& state) { time_selection(state, "select/of-1000", many_distances()); });
    add("bounds/of-1000", time_bounds);
    add("to-refine/of-1000", [](State& state) {
        time_to_refine(state, "to-refine/of-1000", scan::Decided::count_and_selection);
    });
    add("to-refine/selection-of-1000", [](State& state) {
        time_to_refine(state, "to-refine/selection-of-1000", scan::Decided::selection);
    });
    add("list", time_list);
    add("csv", time_csv);
}

}  // namespace merl::bench
