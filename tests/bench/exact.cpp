// What it costs to be exact: the distances that float32 leaves open, beside all in float32.
#include <fmt/format.h>

#include <ctime>

#include "app/pipeline/refine.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "scan/pairs/count.h"
#include "scan/select/undecided.h"
#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"

namespace merl::bench {
namespace {

using engine::Database;

constexpr std::uint32_t kSelect = 100;
constexpr std::uint32_t kPerMaterial = 10;
constexpr std::uint64_t kMemory = 1ULL << 30U;

/// Seconds of this process on all processors: other programs do not count.
double processor_seconds() {
    std::timespec now = {};
    require(::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now) == 0, "no clock of the processor");
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

scan::Distances distances_of(engine::Engines& own, const Database& database) {
    auto computed = engine::compute_distances(own, database, two_metrics());
    return {.names = database.materials(),
            .first_metric = two_metrics()[0]->name,
            .second_metric = two_metrics()[1]->name,
            .first = std::move(computed.distances[0].values),
            .second = std::move(computed.distances[1].values),
            .first_bounds = std::move(computed.distances[0].bounds),
            .second_bounds = std::move(computed.distances[1].bounds)};
}

pipeline::Refined refine(scan::Distances& distances, const Database& database) {
    return pipeline::refine(distances, database, two_metrics(), kSelect, kPerMaterial, kMemory, {});
}

/// The count of refined distances against that of all distances in float64.
double check_count(const Database& database) {
    engine::Engines own;
    auto distances = distances_of(own, database);
    refine(distances, database);
    require(scan::to_refine(distances, kSelect, kPerMaterial).empty(), "not refined");
    auto exact = distances;
    const engine::PairList pairs(distances.materials());
    std::array<engine::Float64Request, 2> all = {{{two_metrics()[0], {}}, {two_metrics()[1], {}}}};
    pairs.each([&](std::size_t /*place*/, std::uint32_t first, std::uint32_t second) {
        all[0].pairs.emplace_back(first, second);
        all[1].pairs.emplace_back(first, second);
    });
    auto values = engine::float64_distances(database, all);
    exact.first = std::move(values[0]);
    exact.second = std::move(values[1]);
    const auto found = scan::count_by_inversions(distances).disagreements();
    const auto expected = scan::count_by_inversions(exact).disagreements();
    require(found == expected, fmt::format("{} disagreements, expected {}", found, expected));
    return 0;
}

void time_exact(benchmark::State& state, const std::string& name, std::size_t materials,
                std::uint32_t divisor) {
    const auto database = coarse_blends(materials, divisor);
    check_once(name, [&] { return check_count(*database); });
    engine::Engines own;
    double float32 = 0;
    double exact = 0;
    pipeline::Refined refined;
    for ([[maybe_unused]] auto _ : state) {
        const double begin = processor_seconds();
        auto distances = distances_of(own, *database);
        const double middle = processor_seconds();
        refined = refine(distances, *database);
        float32 += middle - begin;
        exact += processor_seconds() - middle;
    }
    const auto report = [&](const char* part, double seconds) {
        state.counters[part] = {seconds, benchmark::Counter::kAvgIterations};
    };
    report("float32_s", float32);
    report("exact_s", exact);
    state.counters["ratio"] = exact / float32;
    state.counters["refined"] = static_cast<double>(refined.first + refined.second);
}

}  // namespace

void add_exact() {
    struct Case {
        std::size_t materials;
        std::uint32_t divisor;
    };
    for (const auto& [materials, divisor] : {Case{100, 2}, Case{300, 3}, Case{1000, 5}}) {
        if (!settings().check || materials < 1000) {
            const auto name = fmt::format("exact/{}", materials);
            add(name, [name, m = materials, d = divisor](benchmark::State& state) {
                time_exact(state, name, m, d);
            }).Iterations(1);
        }
    }
}

}  // namespace merl::bench
