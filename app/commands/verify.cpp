#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <memory>
#include <sstream>
#include <stdexcept>

#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/abc_golden.h"
#include "app/commands/commands.h"
#include "app/pipeline/refine.h"
#include "engine/database/abc_database.h"
#include "engine/device/context.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "scan/pairs/census.h"

namespace merl::app {
namespace {

using engine::Metric;
using engine::VoxelSet;

/// Largest relative error allowed: of the framework test (Ryman 2018, table 4.2: six digits) and of
/// a distance.
constexpr double kFrameworkTolerance = 5e-7;
constexpr double kDistanceTolerance = 2e-6;

/// Of a metric without a degree: whatever its functions are on a device.
constexpr double kUnboundedTolerance = 1e-4;

/// Disagreements of the built-in database in float64, by an independent program.
constexpr std::uint64_t kDisagreements = 4'289'737;

struct Options {
    std::string device;
    bool quiet = false;
};

double relative_error(double actual, double expected) {
    return std::abs(actual - expected) / std::abs(expected);
}

double largest_relative_error(const std::vector<double>& actual,
                              const std::vector<double>& expected) {
    if (actual.size() != expected.size()) {
        throw std::logic_error(
            fmt::format("{} distances to compare with {}", actual.size(), expected.size()));
    }
    double largest = 0;
    for (std::size_t i = 0; i < actual.size(); ++i) {
        largest = std::max(largest, relative_error(actual[i], expected[i]));
    }
    return largest;
}

/// The table of checks, printed row by row.
class Report {
  public:
    Report() { print("check", "expected", "actual", "error", "allowed", "result"); }

    void row(const std::string& check, const std::string& expected, const std::string& actual,
             double error, double allowed) {
        const bool pass = error <= allowed;  // false for NaN
        failures_ += pass ? 0 : 1;
        print(check, expected, actual, fmt::format("{:.1e}", error), fmt::format("{:.1e}", allowed),
              pass ? "PASS" : "FAIL");
    }

    void values(const std::string& check, const std::vector<double>& actual,
                const std::vector<double>& expected, double allowed) {
        row(check, fmt::format("{} values", expected.size()),
            fmt::format("{} values", actual.size()), largest_relative_error(actual, expected),
            allowed);
    }

    int failures() const { return failures_; }

  private:
    static void print(std::string_view check, std::string_view expected, std::string_view actual,
                      std::string_view error, std::string_view allowed, std::string_view result) {
        print_line(fmt::format("{:<44} {:>14} {:>14} {:>9} {:>9}  {}", check, expected, actual,
                               error, allowed, result));
    }
    int failures_ = 0;
};

/// The independent float64 distances of the built-in database that the program carries.
struct Golden {
    std::vector<double> cwcbrt, pawcielab;
};

Golden parse_golden() {
    Golden golden;
    std::istringstream lines(kAbcGolden);
    std::string line;
    std::getline(lines, line);
    while (std::getline(lines, line)) {
        const auto last = line.rfind(',');
        const auto before = line.rfind(',', last - 1);
        double first = 0;
        double second = 0;
        std::from_chars(line.data() + before + 1, line.data() + last, first);
        std::from_chars(line.data() + last + 1, line.data() + line.size(), second);
        golden.cwcbrt.push_back(first);
        golden.pawcielab.push_back(second);
    }
    return golden;
}

/// Table 4.2 of Ryman 2018; the expected values are the midpoint sums in float64.
void check_framework(device::Context& context, Report& report) {
    struct Test {
        const char* metric;
        const char* text;
        VoxelSet voxels;
        double expected;
    };
    constexpr std::array<Test, 3> tests = {{
        {"one", "framework: weight 1, every voxel", VoxelSet::all, 1.0},
        {"uniform", "framework: s_MERL", VoxelSet::above_horizon, 1.7725855257099505},
        {"projected-area", "framework: cos cos s_MERL", VoxelSet::above_horizon,
         0.8862569125646411},
    }};
    // The difference is 1 whatever the materials are: two will do.
    const auto database = engine::make_abc_database(
        {}, "material\na,0.1,0.1,0.1,1,1,1,1,1,1.5\nb,0.2,0.2,0.2,1,1,1,1,1,1.5\n");
    const auto all = engine::framework_test_metrics();
    for (const auto& test : tests) {
        const auto found = std::find_if(all.begin(), all.end(),
                                        [&](const Metric& m) { return m.name == test.metric; });
        const std::array<const Metric*, 1> metric = {&*found};
        const auto result =
            engine::compute_distances(context, *database, metric, {.voxels = test.voxels});
        const double actual = result.distances.at(0).values.at(0);
        report.row(test.text, fmt::format("{:.6f}", test.expected), fmt::format("{:.6f}", actual),
                   relative_error(actual, test.expected), kFrameworkTolerance);
    }
}

/// The two ways of compute_distances(), where the device is the processor; elsewhere they are one.
struct Way {
    const char* text;
    bool shaders_only;
};

void check_distances(device::Context& context, const Way& way, Report& report, bool quiet) {
    const auto database = engine::make_abc_database();
    const std::array metrics = {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")};
    engine::DistanceResult result;
    {
        Progress progress("built-in database", quiet);
        result =
            engine::compute_distances(context, *database, metrics,
                                      {.shaders_only = way.shaders_only,
                                       .progress = [&](double share) { progress.update(share); }});
    }
    const auto of = [&](std::string_view name) -> const engine::MetricDistances& {
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            if (metrics[m]->name == name) {
                return result.distances[m];
            }
        }
        throw std::logic_error(fmt::format("no metric {}", name));
    };
    const Golden golden = parse_golden();
    report.values(fmt::format("cwcbrt, independent float64{}", way.text), of("cwcbrt").values,
                  golden.cwcbrt, kDistanceTolerance);
    report.values(fmt::format("pawcielab, independent float64{}", way.text), of("pawcielab").values,
                  golden.pawcielab, kDistanceTolerance);

    scan::Distances distances = {.names = database->materials(),
                                 .first_metric = "cwcbrt",
                                 .second_metric = "pawcielab",
                                 .first = of("cwcbrt").values,
                                 .second = of("pawcielab").values,
                                 .first_bounds = of("cwcbrt").bounds,
                                 .second_bounds = of("pawcielab").bounds};
    refine(distances, *database,
           {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")}, 0, 0,
           engine::DistanceOptions().memory_bytes, {});
    const auto counts = scan::count_disagreements(distances).counts.disagreements();
    const auto difference = std::max(counts, kDisagreements) - std::min(counts, kDisagreements);
    report.row(fmt::format("disagreements{}", way.text), fmt::format("{}", kDisagreements),
               fmt::format("{}", counts), static_cast<double>(difference), 0);
}

/// The library, of which most has no independent table: some pairs of the built-in database on a
/// coarse grid, against the float64 twins.
void check_library(device::Context& context, const Way& way, Report& report) {
    const auto database = engine::make_abc_database({.theta_h = 18, .theta_d = 18, .phi_d = 36});
    const auto all = engine::metrics();
    std::vector<const Metric*> metrics(all.size());
    std::transform(all.begin(), all.end(), metrics.begin(), [](const Metric& m) { return &m; });
    const auto result =
        engine::compute_distances(context, *database, metrics, {.shaders_only = way.shaders_only});
    const auto count = static_cast<std::uint32_t>(database->materials().size());
    std::vector<engine::MaterialPair> pairs;
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
        pairs.emplace_back(i, i + 1);
    }
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        if (!way.shaders_only && !result.plan.on_host(*metrics[m])) {
            continue;
        }
        const auto expected = engine::float64_distances(*database, *metrics[m], pairs);
        std::vector<double> actual(pairs.size());
        std::transform(pairs.begin(), pairs.end(), actual.begin(), [&](const auto& pair) {
            return result.distances[m].values[scan::pair_index({pair.first, pair.second}, count)];
        });
        report.values(fmt::format("{}, its twin{}", metrics[m]->name, way.text), actual, expected,
                      metrics[m]->has_bound() ? kDistanceTolerance : kUnboundedTolerance);
    }
}

int run(const Options& options) {
    try_device_where_limited(options.device);
    device::Context context({.device = options.device});
    print_line(fmt::format("{} ({}), {}", context.info().name, context.info().kind,
                           context.info().driver));
    print_line("");
    Report report;
    check_framework(context, report);
    const std::vector<Way> ways =
        context.limits().is_host
            ? std::vector<Way>{{", on the host", false}, {", in shaders", true}}
            : std::vector<Way>{{"", true}};
    for (const auto& way : ways) {
        check_distances(context, way, report, options.quiet);
        check_library(context, way, report);
    }
    print_line("");
    print_line(report.failures() == 0
                   ? "PASS: this device computes what it should"
                   : fmt::format("FAIL: {} checks; do not trust results of this device",
                                 report.failures()));
    return report.failures() == 0 ? kSuccess : kVerificationFailed;
}

}  // namespace

void add_verify(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "verify", "Check this device: the framework test, and the built-in database in float64");
    command->add_option("--device", options->device,
                        "A Vulkan device by number or part of its name (default: the best)");
    command->add_flag("--quiet", options->quiet, "No progress");
    command->footer(
        "Prints expected and actual values, the relative error (for the disagreements: the\n"
        "difference) and what is allowed. The exit status is 1 if any check fails.\n"
        "\n"
        "Examples:\n"
        "  merl-scan verify\n"
        "  merl-scan verify --device llvmpipe");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
