#include "engine/reflectance/distances.h"

#include <fmt/format.h>

#include "engine/reflectance/abc_database.h"
#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"

namespace merl::bench {
namespace {

using namespace reflectance;

/// The distance stage: its wall-clock time, and as counters the seconds of its parts.
void time_distances(benchmark::State& state, device::Context& context, const Database& database,
                    std::span<const Metric* const> metrics) {
    const auto first = compute_distances(context, database, metrics);
    state.counters["error"] = check_distances(database, metrics, first.distances);
    DistanceSeconds sum;
    for ([[maybe_unused]] auto _ : state) {
        const auto result = compute_distances(context, database, metrics);
        sum.kernels += result.seconds.kernels;
        sum.reading += result.seconds.reading;
        sum.transform += result.seconds.transform;
        sum.difference += result.seconds.difference;
        sum.waiting += result.seconds.waiting;
        sum.adding += result.seconds.adding;
    }
    const auto report = [&](const char* name, double seconds) {
        state.counters[name] = {seconds, benchmark::Counter::kAvgIterations};
    };
    report("kernels_s", sum.kernels);
    report("reading_s", sum.reading);
    report("transform_s", sum.transform);
    report("difference_s", sum.difference);
    report("waiting_s", sum.waiting);
    report("adding_s", sum.adding);
    // Picoseconds a pair and voxel, all metrics together; should not depend on the materials.
    const double work = static_cast<double>(first.voxels) *
                        static_cast<double>(first.distances.front().values.size()) * 1e-12;
    report("difference_ps", sum.difference / work);
    state.counters["device_MiB"] = static_cast<double>(context.peak_allocated_bytes()) / 0x1p20;
}

/// The grid of MERL with fewer steps along each angle.
Grid coarse_grid(std::uint32_t divisor) {
    const Grid merl;
    divisor = settings().check ? 10 : divisor;
    return {merl.theta_h / divisor, merl.theta_d / divisor, merl.phi_d / divisor};
}

/// Computes within a budget that nothing but small slabs keeps.
void check_memory(const Database& database) {
    constexpr std::uint64_t kBudget = 48ULL << 20U;
    device::Context context({.device = settings().device});
    const auto result =
        compute_distances(context, database, two_metrics(), {.memory_bytes = kBudget});
    require(context.peak_allocated_bytes() <= kBudget,
            fmt::format("{}: {} bytes on the device, allowed {}", database.name(),
                        context.peak_allocated_bytes(), kBudget));
}

void time_scale(benchmark::State& state, std::size_t materials) {
    check_memory(BlendedDatabase(*make_abc_database(coarse_grid(5)), materials));
    // An eighth of the voxels of MERL: 400 materials have sixteen times the pairs of 100.
    const BlendedDatabase database(*make_abc_database(coarse_grid(2)), materials);
    device::Context context({.device = settings().device});
    time_distances(state, context, database, two_metrics());
    require(context.peak_allocated_bytes() <= DistanceOptions().memory_bytes,
            fmt::format("{} materials: {} bytes on the device", materials,
                        context.peak_allocated_bytes()));
}

}  // namespace

void add_distances() {
    add("distances/both", [](benchmark::State& state) {
        time_distances(state, context(), database(), two_metrics());
    }).Iterations(1);
    if (settings().check) {
        return;  // the tests of the engine hold every metric to float64
    }
    for (const auto* metric : two_metrics()) {
        add("distances/" + metric->name, [metric](benchmark::State& state) {
            time_distances(state, context(), database(), {&metric, 1});
        }).Iterations(1);
    }
    for (const auto& metric : metrics()) {
        add("library/" + metric.name, [pointer = &metric](benchmark::State& state) {
            time_distances(state, context(), *make_abc_database(coarse_grid(3)), {&pointer, 1});
        }).Iterations(1);
    }
}

void add_scale() {
    for (const std::size_t materials : {25U, 50U, 100U, 200U, 400U}) {
        if (!settings().check || materials == 25 || materials == 400) {
            add(fmt::format("scale/{}", materials), [materials](benchmark::State& state) {
                time_scale(state, materials);
            }).Iterations(1);
        }
    }
}

}  // namespace merl::bench
