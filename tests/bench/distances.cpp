#include "engine/distance/distances.h"

#include <fmt/format.h>

#include "engine/database/model_database.h"
#include "tests/bench/bench.h"
#include "tests/bench/inputs.h"

namespace merl::bench {
namespace {

using namespace engine;

/// Memory that the engines held.
std::uint64_t bytes_of(const DistanceResult& result) {
    std::uint64_t bytes = 0;
    for (const auto& use : result.engines) {
        bytes += use.peak_bytes;
    }
    return bytes;
}

/// The distance stage: its wall-clock time, and as counters the seconds of its parts. `twins` are
/// metrics with the same distances that have a float64 twin. Of all pairs, or of those listed.
void time_distances(benchmark::State& state, const std::string& name, Engines& engines,
                    const Database& database, std::span<const Metric* const> metrics,
                    std::span<const Metric* const> twins,
                    std::span<const MaterialPair> listed = {}) {
    const DistanceOptions options = {.pairs = listed};
    const double error = check_once(name, [&] {
        const auto result = compute_distances(engines, database, metrics, options);
        const auto materials = static_cast<std::uint32_t>(database.materials().size());
        return check_distances(database, twins, PairList(materials, listed), result.distances);
    });
    DistanceSeconds sum;
    double work = 0;  // pairs times voxels
    std::uint64_t bytes = 0;
    for ([[maybe_unused]] auto _ : state) {
        const auto result = compute_distances(engines, database, metrics, options);
        bytes = bytes_of(result);
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
    state.counters["slabs_MiB"] = static_cast<double>(bytes) / 0x1p20;
}

/// Computes within a budget that nothing but small slabs keeps, on the host and in shaders.
void check_memory(const Database& database) {
    constexpr std::uint64_t kBudget = 48ULL << 20U;
    for (const auto use : {Engines::Use::rest, Engines::Use::everything}) {
        device::Context context({.device = settings().device});
        Engines engines(context, use);
        const auto bytes = bytes_of(
            compute_distances(engines, database, two_metrics(), {.memory_bytes = kBudget}));
        require(bytes <= kBudget,
                fmt::format("{}: slabs of {} bytes, allowed {}", database.name(), bytes, kBudget));
    }
}

void time_scale(benchmark::State& state, const std::string& name, std::size_t materials) {
    check_once("memory of " + name, [&] {
        check_memory(*coarse_blends(materials, 5));
        return 0;
    });
    // More voxels for few materials: the work of the pairs should be more than what surrounds it.
    const std::uint32_t divisor = materials <= 100 ? 2 : 3;
    Engines own;
    time_distances(state, name, own, *coarse_blends(materials, divisor), two_metrics(),
                   two_metrics());
    const double budget = static_cast<double>(DistanceOptions().memory_bytes) / 0x1p20;
    require(state.counters["slabs_MiB"] <= budget,
            fmt::format("{} materials: slabs of more than {} MiB", materials, budget));
}

/// Half as many pairs as materials, of which none is in two.
void add_listed() {
    for (const bool in_shaders : {false, true}) {
        const std::string name = in_shaders ? "listed/shaders" : "listed/host";
        add(name, [name, in_shaders](benchmark::State& state) {
            std::vector<MaterialPair> pairs;
            for (std::uint32_t m = 0; m < 50; ++m) {
                pairs.emplace_back(m, m + 50);
            }
            time_distances(state, name, in_shaders ? shader_engines() : engines(),
                           *open_model("abc", coarse_grid(2)), two_metrics(), two_metrics(), pairs);
        }).Iterations(1);
    }
}

/// Another way to the same distances: through the shaders on every device, and what the framework
/// makes of a metric that has no C++ twin, and of one that does not declare its degree either.
enum class Variant { library, shaders, of_a_user, without_degree };

Metric variant_of(const Metric& metric, Variant variant) {
    Metric result = metric;
    if (variant == Variant::of_a_user || variant == Variant::without_degree) {
        result.twin = {};
    }
    if (variant == Variant::without_degree) {
        const auto replace = [&](const std::string& from, const std::string& to) {
            const auto at = result.source.find(from);
            require(at != std::string::npos, fmt::format("{}: no {}", metric.name, from));
            result.source.replace(at, from.size(), to);
        };
        replace("// degree:", "// note: the degree is");
        replace("float difference(float d) {", "float one_channel(float d) {");
        result.source +=
            "float difference(vec3 a, vec3 b) { vec3 d = a - b; return one_channel(d.x) + "
            "one_channel(d.y) + one_channel(d.z); }\n";
        result.header = parse_metric_header(result.source, result.file);
    }
    return result;
}

void add_variants() {
    constexpr std::array<std::pair<Variant, const char*>, 4> variants = {
        {{Variant::library, "library"},
         {Variant::shaders, "shaders"},
         {Variant::of_a_user, "of-a-user"},
         {Variant::without_degree, "without-degree"}}};
    for (const auto* metric : two_metrics()) {
        for (const auto& [variant, what] : variants) {
            const auto name = fmt::format("variant/{}/{}", metric->name, what);
            add(name, [name, metric, kind = variant](benchmark::State& state) {
                const Metric chosen = variant_of(*metric, kind);
                const Metric* const pointer = &chosen;
                time_distances(state, name, kind == Variant::library ? engines() : shader_engines(),
                               *open_model("abc", coarse_grid(3)), {&pointer, 1}, {&metric, 1});
            }).Iterations(1);
        }
    }
}

void add_stage(const std::string& name, std::vector<const Metric*> metrics, Engines& engines) {
    add(name, [=, &engines](benchmark::State& state) {
        time_distances(state, name, engines, database(), metrics, metrics);
    }).Iterations(1);
}

}  // namespace

void add_distances() {
    add_stage("distances/both", {two_metrics()[0], two_metrics()[1]}, engines());
    add_stage("distances/shaders", {two_metrics()[0], two_metrics()[1]}, shader_engines());
    add_variants();
    add_listed();
    if (settings().check) {
        return;  // the tests of the engine hold every metric to float64
    }
    for (const auto* metric : two_metrics()) {
        add_stage("distances/" + metric->name, {metric}, engines());
    }
    for (const auto& metric : metrics()) {
        const auto name = "library/" + metric.name;
        add(name, [name, pointer = &metric](benchmark::State& state) {
            time_distances(state, name, engines(), *open_model("abc", coarse_grid(3)),
                           {&pointer, 1}, {&pointer, 1});
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
