#include "engine/reflectance/distances.h"

#include <fmt/format.h>

#include "engine/reflectance/abc_database.h"
#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"

namespace merl::bench {
namespace {

using namespace reflectance;

/// The distance stage: its wall-clock time, and as counters the seconds of its parts.
void time_distances(benchmark::State& state, const std::string& name, device::Context& context,
                    const Database& database, std::span<const Metric* const> metrics) {
    const double error = check_once(name, [&] {
        const auto result = compute_distances(context, database, metrics);
        return check_distances(database, metrics, result.distances);
    });
    DistanceSeconds sum;
    double work = 0;  // pairs times voxels
    for ([[maybe_unused]] auto _ : state) {
        const auto result = compute_distances(context, database, metrics);
        sum.kernels += result.seconds.kernels;
        sum.reading += result.seconds.reading;
        sum.transform += result.seconds.transform;
        sum.difference += result.seconds.difference;
        sum.waiting += result.seconds.waiting;
        sum.adding += result.seconds.adding;
        work += static_cast<double>(result.voxels) *
                static_cast<double>(result.distances.front().values.size());
    }
    const auto report = [&](const char* part, double seconds) {
        state.counters[part] = {seconds, benchmark::Counter::kAvgIterations};
    };
    report("kernels_s", sum.kernels);
    report("reading_s", sum.reading);
    report("transform_s", sum.transform);
    report("difference_s", sum.difference);
    report("waiting_s", sum.waiting);
    report("adding_s", sum.adding);
    // A pair and voxel, all metrics together; should not depend on the number of materials.
    state.counters["difference_ps"] = 1e12 * sum.difference / work;
    state.counters["error"] = error;
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

void time_scale(benchmark::State& state, const std::string& name, std::size_t materials) {
    check_once("memory of " + name, [&] {
        check_memory(BlendedDatabase(*make_abc_database(coarse_grid(5)), materials));
        return 0;
    });
    const BlendedDatabase database(*make_abc_database(coarse_grid(3)), materials);
    device::Context context({.device = settings().device});
    time_distances(state, name, context, database, two_metrics());
    require(context.peak_allocated_bytes() <= DistanceOptions().memory_bytes,
            fmt::format("{} materials: {} bytes on the device", materials,
                        context.peak_allocated_bytes()));
}

void add_stage(const std::string& name, std::vector<const Metric*> metrics) {
    add(name, [name, metrics = std::move(metrics)](benchmark::State& state) {
        time_distances(state, name, context(), database(), metrics);
    }).Iterations(1);
}

}  // namespace

void add_distances() {
    add_stage("distances/both", {two_metrics()[0], two_metrics()[1]});
    if (settings().check) {
        return;  // the tests of the engine hold every metric to float64
    }
    for (const auto* metric : two_metrics()) {
        add_stage("distances/" + metric->name, {metric});
    }
    for (const auto& metric : metrics()) {
        const auto name = "library/" + metric.name;
        add(name, [name, pointer = &metric](benchmark::State& state) {
            time_distances(state, name, context(), *make_abc_database(coarse_grid(3)),
                           {&pointer, 1});
        }).Iterations(1);
    }
}

void add_scale() {
    for (const std::size_t materials : {25U, 50U, 100U, 200U, 400U}) {
        if (!settings().check || materials == 25 || materials == 400) {
            const auto name = fmt::format("scale/{}", materials);
            add(name, [name, materials](benchmark::State& state) {
                time_scale(state, name, materials);
            }).Iterations(1);
        }
    }
}

}  // namespace merl::bench
