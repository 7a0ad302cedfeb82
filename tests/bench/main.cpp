// Times the stages of a scan, and other programs at the same work. Each checks its result before it
// is timed (docs/performance.md). Options that are not ours are Google Benchmark's.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <vector>

#include "tests/bench/bench.h"

namespace merl::bench {
namespace {

Settings& mutable_settings() {
    static Settings settings;
    return settings;
}

int& failures() {
    static int count = 0;
    return count;
}

int run(int argc, char** argv) {
    CLI::App program(
        "Benchmark of merl-scan. Other options, such as --benchmark_filter, go to "
        "Google Benchmark.");
    auto& settings = mutable_settings();
    program
        .add_option("--database", settings.database,
                    "A directory of MERL .binary files (default: the built-in database)")
        ->envname("MERL_SCAN_BENCH_DATABASE");
    program.add_option("--device", settings.device,
                       "A Vulkan device by number or part of its name");
    program.add_flag("--check", settings.check,
                     "Coarse grids of the built-in database and everything once: only whether "
                     "results are right");
    program.allow_extras();
    CLI11_PARSE(program, argc, argv);
    if (settings.check) {
        settings.database.clear();
    }

    auto rest = program.remaining();
    std::vector<char*> arguments = {argv[0]};
    for (auto& argument : rest) {
        arguments.push_back(argument.data());
    }
    auto count = static_cast<int>(arguments.size());
    arguments.push_back(nullptr);
    benchmark::Initialize(&count, arguments.data());
    if (benchmark::ReportUnrecognizedArguments(count, arguments.data())) {
        return 2;
    }
    add_reading();
    add_distances();
    add_scale();
    add_exact();
    add_scan();
    add_peers();
    if (benchmark::RunSpecifiedBenchmarks() == 0) {
        fmt::print(stderr, "no benchmark has such a name\n");
        return 2;
    }
    benchmark::Shutdown();
    if (failures() > 0) {
        fmt::print(stderr, "{} failed\n", failures());
        return 1;
    }
    return 0;
}

}  // namespace

const Settings& settings() {
    return mutable_settings();
}

benchmark::internal::Benchmark& add(const std::string& name,
                                    const std::function<void(benchmark::State&)>& body,
                                    Clock clock) {
    auto& added = *benchmark::RegisterBenchmark(name.c_str(), [body](benchmark::State& state) {
        try {
            body(state);
        } catch (const std::exception& error) {
            ++failures();
            state.SkipWithError(error.what());
        }
    });
    added.Unit(benchmark::kMillisecond);
    clock == Clock::wall ? added.UseRealTime() : added.UseManualTime();
    if (settings().check) {
        added.Iterations(1);
    }
    return added;
}

double check_once(const std::string& name, const std::function<double()>& check) {
    static std::map<std::string, double> errors;
    auto found = errors.find(name);
    if (found == errors.end()) {
        found = errors.emplace(name, check()).first;
    }
    return found->second;
}

void require(bool right, const std::string& what) {
    if (!right) {
        throw std::runtime_error(what);
    }
}

}  // namespace merl::bench

int main(int argc, char** argv) {
    try {
        return merl::bench::run(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
}
