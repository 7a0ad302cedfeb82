#include "app/pipeline/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "app/pipeline/abc_golden.h"
#include "app/pipeline/refine.h"
#include "engine/base/error.h"
#include "engine/database/model_database.h"
#include "engine/database/subset_database.h"
#include "engine/device/context.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "scan/pairs/count.h"

namespace merl::pipeline {
namespace {

using engine::Metric;
using engine::VoxelSet;

/// Largest relative error allowed: of the framework test (Ryman 2018, table 4.2: six digits) and of
/// a distance.
constexpr double kFrameworkTolerance = 5e-7;
constexpr double kDistanceTolerance = 2e-6;

/// Of a metric without a degree: whatever its functions are on a device.
constexpr double kUnboundedTolerance = 1e-4;

/// Of a summary, which is in float64.
constexpr double kSummaryTolerance = 1e-12;

double tolerance(const Metric& metric) {
    return metric.is_summary()  ? kSummaryTolerance
           : metric.has_bound() ? kDistanceTolerance
                                : kUnboundedTolerance;
}

/// Disagreements of the built-in database in float64, by an independent program.
constexpr std::uint64_t kDisagreements = 4'289'737;

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

/// The checks of one engine.
class Report {
  public:
    Report(const VerifySink& sink, const engine::EngineDescription& engine)
        : sink_(sink), way_(engine.engine == engine::kHost ? ", on the host" : ", in shaders") {}

    void row(const std::string& name, const std::string& expected, const std::string& actual,
             double error, double allowed) {
        const Check check = {name, expected, actual, error, allowed};
        failures_ += check.passed() ? 0 : 1;
        sink_.check(check);
    }

    void values(const std::string& name, const std::vector<double>& actual,
                const std::vector<double>& expected, double allowed) {
        row(name, fmt::format("{} values", expected.size()),
            fmt::format("{} values", actual.size()), largest_relative_error(actual, expected),
            allowed);
    }

    /// How the engine computes, for the names of checks.
    const std::string& way() const { return way_; }

    int failures() const { return failures_; }

  private:
    const VerifySink& sink_;
    std::string way_;
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
void check_framework(engine::Engines& engines, Report& report) {
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
    const auto database = engine::make_subset(engine::open_model("abc"), {0, 1});
    const auto all = engine::framework_test_metrics();
    for (const auto& test : tests) {
        const auto found = std::find_if(all.begin(), all.end(),
                                        [&](const Metric& m) { return m.name == test.metric; });
        const std::array<const Metric*, 1> metric = {&*found};
        const auto result =
            engine::compute_distances(engines, *database, metric, {.voxels = test.voxels});
        const double actual = result.distances.at(0).values.at(0);
        report.row(test.text, fmt::format("{:.6f}", test.expected), fmt::format("{:.6f}", actual),
                   relative_error(actual, test.expected), kFrameworkTolerance);
    }
}

void check_distances(engine::Engines& engines, Report& report, const Control& control) {
    const auto database = engine::open_model("abc");
    const std::array metrics = {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")};
    const auto result = engine::compute_distances(engines, *database, metrics,
                                                  {.progress = control.stage("built-in database")});
    const auto of = [&](std::string_view name) -> const engine::MetricDistances& {
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            if (metrics[m]->name == name) {
                return result.distances[m];
            }
        }
        throw std::logic_error(fmt::format("no metric {}", name));
    };
    const Golden golden = parse_golden();
    report.values(fmt::format("cwcbrt, independent float64{}", report.way()), of("cwcbrt").values,
                  golden.cwcbrt, kDistanceTolerance);
    report.values(fmt::format("pawcielab, independent float64{}", report.way()),
                  of("pawcielab").values, golden.pawcielab, kDistanceTolerance);

    scan::Distances distances = {.names = database->materials(),
                                 .first_metric = "cwcbrt",
                                 .second_metric = "pawcielab",
                                 .first = of("cwcbrt").values,
                                 .second = of("pawcielab").values,
                                 .first_bounds = of("cwcbrt").bounds,
                                 .second_bounds = of("pawcielab").bounds};
    refine(distances, *database,
           {&engine::find_metric("cwcbrt"), &engine::find_metric("pawcielab")}, 0, 0,
           engine::DistanceOptions().memory_bytes,
           {.refining = control.stage("built-in database")});
    const auto counts = scan::count_disagreements(distances).counts.disagreements();
    const auto difference = std::max(counts, kDisagreements) - std::min(counts, kDisagreements);
    report.row(fmt::format("disagreements{}", report.way()), fmt::format("{}", kDisagreements),
               fmt::format("{}", counts), static_cast<double>(difference), 0);
}

/// Metrics against their float64 twins: some pairs of the built-in database on a coarse grid.
void check_twins(engine::Engines& engines, Report& report, const engine::Grid& grid,
                 const std::vector<const Metric*>& metrics) {
    const auto database = engine::open_model("abc", grid);
    const auto result = engine::compute_distances(engines, *database, metrics);
    const auto count = static_cast<std::uint32_t>(database->materials().size());
    std::vector<engine::MaterialPair> pairs;
    for (std::uint32_t i = 0; i + 1 < count; ++i) {
        pairs.emplace_back(i, i + 1);
    }
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        const auto expected = engine::float64_distances(*database, *metrics[m], pairs);
        std::vector<double> actual(pairs.size());
        std::transform(pairs.begin(), pairs.end(), actual.begin(), [&](const auto& pair) {
            return result.distances[m].values[scan::pair_index({pair.first, pair.second}, count)];
        });
        report.values(fmt::format("{}, its twin{}", metrics[m]->name, report.way()), actual,
                      expected, tolerance(*metrics[m]));
    }
}

/// The library, of which most has no independent table. Windows of summaries need more layers.
void check_library(engine::Engines& engines, Report& report) {
    std::vector<const Metric*> sums;
    std::vector<const Metric*> summaries;
    for (const auto& metric : engine::metrics()) {
        (metric.is_summary() ? summaries : sums).push_back(&metric);
    }
    check_twins(engines, report, {.theta_h = 18, .theta_d = 18, .phi_d = 36}, sums);
    check_twins(engines, report, {.theta_h = 30, .theta_d = 30, .phi_d = 60}, summaries);
}

/// What is checked where nothing was chosen.
std::vector<std::string> all_engines() {
    std::vector<std::string> engines = {engine::kHost};
    try {
        const auto devices = device::list_devices();
        engines.push_back(std::to_string(devices[device::choose_device(devices, "")].index));
    } catch (const Error&) {  // the host engine needs none
    }
    return engines;
}

/// What an engine says of itself, once it is open.
engine::EngineDescription open_engine(engine::Engines& engines) {
    const Metric* const any[] = {&engine::find_metric("rmse")};
    std::vector<std::string> warnings;
    return engines.share(any, warnings).front().engine->description();
}

}  // namespace

int verify(const device::ContextOptions& device, const VerifySink& sink, const Control& control) {
    int failures = 0;
    for (const auto& name : device.device.empty() ? all_engines() : std::vector{device.device}) {
        auto one = device;
        one.device = name;
        engine::Engines engines(one);
        const auto description = open_engine(engines);
        sink.engine(description);
        Report report(sink, description);
        check_framework(engines, report);
        check_distances(engines, report, control);
        check_library(engines, report);
        failures += report.failures();
    }
    return failures;
}

}  // namespace merl::pipeline
