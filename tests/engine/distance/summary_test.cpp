#include "engine/distance/parts/summary.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <functional>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/database/model_database.h"
#include "engine/database/subset_database.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "engine/distance/parts/window_check.h"
#include "engine/metric/metric_library.h"
#include "tests/engine/support.h"

namespace merl::engine {

/// tests/engine/metric/twins/, compiled by the build like the library.
std::span<const BuiltMetric> built_test_metrics();

namespace {

using test::FunctionDatabase;

Metric borders() {
    const auto& built = built_test_metrics().back();
    Metric metric;
    metric.name = built.name;
    metric.file = "window-borders.glsl";
    metric.source = built.source;
    metric.header = parse_metric_header(metric.source, metric.file);
    metric.twin = built.twin;
    return metric;
}

/// A library metric as if it were a user's.
Metric without_twin(Metric metric) {
    metric.twin = {};
    return metric;
}

/// The layers of theta_d, or of theta_h, that have voxels in a window.
std::vector<std::uint64_t> layers_in(const Metric& metric, std::uint32_t window, const Grid& grid,
                                     bool of_theta_d) {
    const Domain domain(grid);
    const std::uint64_t layers = of_theta_d ? grid.theta_d : grid.theta_h;
    std::vector<Voxel> voxels(kBlockVoxels);
    for (std::uint64_t i = 0; i < layers; ++i) {
        voxels[i] = domain.voxel(of_theta_d ? i * grid.phi_d : i * grid.phi_d * grid.theta_d);
    }
    BlockWeights weights;
    metric.twin.window(metric.parameters, std::span<const Voxel, kBlockVoxels>(voxels), window,
                       weights);
    std::vector<std::uint64_t> inside;
    for (std::uint64_t i = 0; i < layers; ++i) {
        if (weights[i] > 0) {
            inside.push_back(i);
        }
    }
    return inside;
}

/// Of 9 layers of theta_d the centres are at 5, 15, 25 ... degrees; of 15 of theta_h the first is
/// at 3/90 and the second at 9/90 of M_t; of 3 and 9 of theta_h one is at 22.5 degrees, and of 9
/// one at 40 - exactly, where the angle in radians is not.
TEST(Summary, BordersAreDecidedExactly) {
    const Metric metric = borders();
    const auto layers = [&](std::uint32_t window, const Grid& grid, bool of_theta_d = false) {
        return layers_in(metric, window, grid, of_theta_d);
    };
    using Layers = std::vector<std::uint64_t>;
    EXPECT_EQ(layers(0, {.theta_h = 2, .theta_d = 9, .phi_d = 2}, true), (Layers{0, 1}));
    EXPECT_EQ(layers(0, {.theta_h = 2, .theta_d = 90, .phi_d = 2}, true).front(), 5U);
    EXPECT_EQ(layers(0, {.theta_h = 2, .theta_d = 90, .phi_d = 2}, true).back(), 24U);
    EXPECT_EQ(layers(1, {.theta_h = 15, .theta_d = 2, .phi_d = 2}), (Layers{0}));
    EXPECT_EQ(layers(1, {.theta_h = 90, .theta_d = 2, .phi_d = 2}), (Layers{3, 4, 5}));
    EXPECT_EQ(layers(2, {.theta_h = 3, .theta_d = 2, .phi_d = 2}), (Layers{1}));
    EXPECT_EQ(layers(2, {.theta_h = 9, .theta_d = 2, .phi_d = 2}), (Layers{4, 5}));
    EXPECT_EQ(layers(2, {.theta_h = 33, .theta_d = 2, .phi_d = 2}).front(), 16U);
    // 40 degrees is at 2/3 of M_t: 2k + 1 = 4n/3, which has no solution; the largest grid goes
    // through the largest numbers.
    EXPECT_EQ(layers(2, {.theta_h = 1023, .theta_d = 2, .phi_d = 2}).front(), 511U);
    EXPECT_EQ(layers(2, {.theta_h = 1023, .theta_d = 2, .phi_d = 2}).back(), 681U);
}

/// The counts of the specification.
TEST(Summary, WindowsOfTheLibraryOnTheGridOfMerl) {
    const Metric& metric = find_metric("gloss-contrast");
    const Domain domain({});
    std::vector<std::uint64_t> counts(metric.header.windows.size());
    std::vector<Voxel> voxels(kBlockVoxels);
    BlockWeights weights;
    for (std::uint64_t first = 0; first < Grid{}.voxels(); first += kBlockVoxels) {
        const auto size = std::min<std::uint64_t>(kBlockVoxels, Grid{}.voxels() - first);
        for (std::uint64_t k = 0; k < size; ++k) {
            voxels[k] = domain.voxel(first + k);
        }
        for (std::uint32_t w = 0; w < counts.size(); ++w) {
            metric.twin.window(metric.parameters, std::span<const Voxel, kBlockVoxels>(voxels), w,
                               weights);
            for (std::uint64_t k = 0; k < size; ++k) {
                counts[w] += voxels[k].above_horizon() && weights[k] == 1 ? 1U : 0U;
                EXPECT_TRUE(weights[k] == 0 || weights[k] == 1);
            }
        }
    }
    EXPECT_EQ(counts[0], 21'600U);
    EXPECT_EQ(counts[1], 43'200U);
    EXPECT_EQ(counts[2], 52'416U);
    for (std::size_t w = 3; w + 1 < counts.size(); ++w) {
        const std::array<std::uint64_t, 10> borders = {0, 3, 6, 12, 18, 27, 39, 54, 66, 78};
        const auto all = (borders[w - 2] - borders[w - 3]) * 20 * 180;
        EXPECT_LE(counts[w], all);
        if (borders[w - 2] <= 75) {  // theta_h up to 62.5 degrees: nothing is below the horizon
            EXPECT_EQ(counts[w], all) << w;
        }
    }
}

TEST(Summary, EmptyWindowsAreNamed) {
    const Metric& metric = find_metric("gloss-contrast");
    EXPECT_TRUE(empty_windows(metric, {}).empty());
    EXPECT_TRUE(empty_windows(metric, {.theta_h = 23, .theta_d = 23, .phi_d = 46}).empty());
    for (std::uint32_t n = 2; n <= 22; ++n) {
        EXPECT_FALSE(empty_windows(metric, {.theta_h = n, .theta_d = n, .phi_d = 2 * n}).empty())
            << n;
    }
    // All of them: the six layers are at 7.5, 22.5, 37.5, 52.5, 67.5 and 82.5 of the 90.
    EXPECT_EQ(empty_windows(metric, {.theta_h = 6, .theta_d = 6, .phi_d = 12}),
              (std::vector<std::string>{"lobe", "layers_0", "layers_3", "layers_12", "layers_54"}));
    // Of a metric with a degree, that has windows for nothing else.
    const Metric& over_voxels = find_metric("window-log");
    std::vector<std::uint32_t> without;
    for (std::uint32_t n = 2; n <= 40; ++n) {
        const auto empty = empty_windows(over_voxels, {.theta_h = n, .theta_d = n, .phi_d = 2 * n});
        if (!empty.empty()) {
            EXPECT_EQ(empty, std::vector<std::string>{"highlight"}) << n;
            without.push_back(n);
        }
    }
    EXPECT_EQ(without, (std::vector<std::uint32_t>{2, 3, 7, 8, 9, 10}));
    EXPECT_TRUE(
        empty_windows(find_metric("rmse"), {.theta_h = 1, .theta_d = 1, .phi_d = 1}).empty());
    const auto small = open_model("abc", {.theta_h = 6, .theta_d = 6, .phi_d = 12});
    const Metric of_a_user = without_twin(metric);
    for (const auto* one : {&metric, &of_a_user}) {
        const Metric* const list[] = {one};
        for (const bool in_shaders : {false, true}) {
            try {
                compute_distances(test::engines(in_shaders), *small, list);
                FAIL() << in_shaders;
            } catch (const InputError& error) {
                EXPECT_NE(std::string(error.what()).find("\"lobe\", \"layers_0\""),
                          std::string::npos)
                    << error.what();
                EXPECT_NE(std::string(error.what()).find("6 x 6 x 12"), std::string::npos);
            }
        }
    }
}

/// Samples by voxel: one material without red in the whole of a window, one with gaps here and
/// there, one without.
double with_gaps(std::size_t material, std::uint64_t voxel, std::size_t channel) {
    const double sample = std::abs(test::random_sample(material, voxel, channel));
    if (material == 0 && channel == 0 && voxel < 24 * 11 * 10) {
        return -1;
    }
    return material == 1 && (voxel * 7 + channel) % 5 == 0 ? -sample : sample;
}

TEST(Summary, MeansLeaveOutWhatWasNotMeasured) {
    const Grid grid = {.theta_h = 24, .theta_d = 11, .phi_d = 24};
    const FunctionDatabase database(grid, 3, with_gaps);
    const Metric metric = borders();
    const Metric of_a_user = without_twin(metric);
    // Straight from the definition.
    const Domain domain(grid);
    std::vector<WindowMean> expected;
    for (std::size_t m = 0; m < 3; ++m) {
        for (std::uint32_t w = 0; w < 4; ++w) {
            std::array<long double, 3> sums = {};
            std::array<long double, 3> weights = {};
            for (std::uint64_t k = 0; k < grid.voxels(); ++k) {
                const Voxel v = domain.voxel(k);
                const double degrees = 90.0 * (2 * v.theta_d_layer + 1) / (2.0 * v.theta_d_layers);
                const double m_t = (v.theta_h_layer + 0.5) / 24;
                const double weight = w == 0   ? (degrees >= 5 && degrees < 25 ? 1 : 0)
                                      : w == 1 ? (m_t >= 3 / 90.0 && m_t < 6 / 90.0 ? 1 : 0)
                                      : w == 2
                                          ? (90 * m_t * m_t >= 22.5 && 90 * m_t * m_t < 40 ? 1 : 0)
                                          : std::max(0.0, v.theta_d - 0.7);
                for (std::size_t c = 0; c < 3; ++c) {
                    const double sample = with_gaps(m, k, c);
                    if (v.above_horizon() && sample >= 0) {
                        sums[c] += static_cast<long double>(weight) * sample;
                        weights[c] += weight;
                    }
                }
            }
            auto& mean = expected.emplace_back();
            for (std::size_t c = 0; c < 3; ++c) {
                mean[c] = weights[c] > 0 ? static_cast<double>(sums[c] / weights[c]) : 0;
            }
        }
    }
    EXPECT_EQ(expected[1][0], 0);  // of the first material no red was measured there
    EXPECT_GT(expected[1][1], 0);
    // A metric that must not notice any of it beside one that does.
    const Metric& other = find_metric("cwcbrt");
    const Metric* const alone[] = {&other};
    const std::array<std::array<const Metric*, 2>, 2> both = {
        {{&metric, &other}, {&other, &of_a_user}}};
    std::vector<std::vector<WindowMean>> found;
    for (const bool in_shaders : {false, true}) {
        const auto others =
            compute_distances(test::engines(in_shaders), database, alone).distances[0];
        for (std::size_t i = 0; i < both.size(); ++i) {
            const auto result = compute_distances(test::engines(in_shaders), database, both[i]);
            const auto& summary = result.distances[i];
            ASSERT_EQ(summary.means.size(), expected.size());
            for (std::size_t at = 0; at < expected.size(); ++at) {
                for (std::size_t c = 0; c < 3; ++c) {
                    EXPECT_NEAR(summary.means[at][c], expected[at][c], 1e-14 * expected[at][c]);
                }
            }
            found.push_back(summary.means);
            EXPECT_EQ(result.distances[1 - i], others);
            const std::vector<MaterialPair> pairs = {{0, 1}, {0, 2}, {1, 2}};
            const auto exact = float64_distances(database, metric, pairs);
            for (std::size_t p = 0; p < pairs.size(); ++p) {
                EXPECT_LE(std::abs(summary.values[p] - exact[p]), summary.bounds[p]);
                EXPECT_LT(summary.bounds[p], 1e-11);  // means are in the hundreds
            }
        }
    }
    for (const auto& means : found) {
        EXPECT_EQ(means, found[0]);  // bit by bit, whatever computed them
    }
}

TEST(Summary, DoesNotDependOnSlabSizeStagingOrThreads) {
    const FunctionDatabase database({.theta_h = 40, .theta_d = 30, .phi_d = 36}, 13,
                                    test::random_sample);
    const Metric& metric = find_metric("gloss-contrast");
    const Metric of_a_user = without_twin(metric);
    const Metric* const both[] = {&metric, &of_a_user};
    for (const auto use : {Engines::Use::rest, Engines::Use::everything}) {
        Engines mapped(test::lavapipe(), use);
        Engines staging(test::lavapipe_with_staging(), use);
        const auto whole = compute_distances(mapped, database, both);
        EXPECT_EQ(whole.distances[0].means, whole.distances[1].means);
        for (const std::size_t threads : {1U, 2U, 5U}) {
            const tbb::global_control control(tbb::global_control::max_allowed_parallelism,
                                              threads);
            const auto cut = compute_distances(threads == 2 ? staging : mapped, database, both,
                                               {.memory_bytes = 7'000'000});
            EXPECT_NE(cut.slabs, whole.slabs);
            EXPECT_EQ(cut.distances, whole.distances);
        }
    }
}

TEST(Summary, DistancesUnderOtherParametersComeFromMeans) {
    const auto database = open_model("abc", {.theta_h = 30, .theta_d = 30, .phi_d = 60});
    const Metric& metric = find_metric("gloss-contrast");
    auto parameters = metric.parameters;
    parameters[2] = 1;      // haze
    parameters.back() = 0;  // profile
    const std::function<void()> meanwhile = [] {};
    for (const auto& one : {metric, without_twin(metric)}) {
        const Metric other = with_parameters(one, parameters);
        EXPECT_EQ(other.name, one.name + ":haze=1:profile=0");
        EXPECT_EQ(with_parameters(other, one.parameters).name, one.name);
        for (const bool in_shaders : {false, true}) {
            auto& engines = test::engines(in_shaders);
            const Metric* const list[] = {&one};
            const Metric* const others[] = {&other};
            std::vector<std::string> warnings;
            auto& engine = *engines.share(list, warnings).front().engine;
            const auto means = compute_distances(engines, *database, list).distances[0].means;
            const auto whole = compute_distances(engines, *database, others).distances[0];
            EXPECT_EQ(whole.means, means);
            EXPECT_EQ(summary_values(other, means, engine.features(other, meanwhile),
                                     database->materials()),
                      whole.values);
            if (one.has_twin() && !in_shaders) {
                EXPECT_EQ(summary_values(other, means, twin_features(other), database->materials()),
                          whole.values);
            }
        }
    }
}

/// Of the library that is every bit: means have one order, and features are those of the twin.
TEST(Summary, TheLibraryHasTheSameBitsOnEveryEngine) {
    const FunctionDatabase database({.theta_h = 24, .theta_d = 12, .phi_d = 24}, 20,
                                    test::random_sample);
    const Metric other = open_metric("gloss-contrast:haze=3:tint=1e-9:blue_yellow=10");
    const Metric* const both[] = {&find_metric("gloss-contrast"), &other};
    EXPECT_EQ(compute_distances(test::engines(false), database, both).distances,
              compute_distances(test::engines(true), database, both).distances);
}

/// Where shaders have no float64 the host does all of it.
TEST(Summary, NeedsNoFloat64OfADevice) {
    const auto database = open_model("abc", {.theta_h = 30, .theta_d = 30, .phi_d = 60});
    Engines without(test::lavapipe_without_float64());
    const Metric* const both[] = {&find_metric("rmse"), &find_metric("gloss-contrast")};
    const auto found = compute_distances(without, *database, both);
    ASSERT_EQ(found.engines.size(), 2U);
    EXPECT_EQ(found.engines[0].engine.engine, "vulkan");
    EXPECT_EQ(found.engines[1].engine.engine, "host");
    EXPECT_EQ(found.engines[1].metrics, std::vector<std::size_t>{1});
    const Metric* const one[] = {&find_metric("gloss-contrast")};
    Engines host({.device = kHost});
    EXPECT_EQ(compute_distances(host, *database, one).distances[0], found.distances[1]);
}

/// What `tune` does: other parameters, the same means.
TEST(Summary, FeaturesOfOtherParametersNeedNoSamples) {
    const auto database = open_model("abc", {.theta_h = 30, .theta_d = 30, .phi_d = 60});
    const Metric& usual = find_metric("gloss-contrast");
    const Metric other = open_metric("gloss-contrast:haze=2:profile=0");
    const Metric* const both[] = {&usual, &other};
    Engines host({.device = kHost});
    const auto found = compute_distances(host, *database, both);
    EXPECT_EQ(
        summary_distances(other, found.distances[0].means, PairList(100), database->materials()),
        found.distances[1]);
}

/// A row of the golden values: two materials, and their distances.
struct GoldenRow {
    std::array<std::string, 2> materials;
    std::array<double, 3> distances;
};

std::vector<GoldenRow> golden_rows() {
    std::ifstream file(MERL_GLOSS_GOLDEN_CSV);
    std::string line;
    std::getline(file, line);
    std::vector<GoldenRow> rows;
    while (std::getline(file, line)) {
        std::istringstream fields(line);
        auto& row = rows.emplace_back();
        for (auto& material : row.materials) {
            std::getline(fields, material, ',');
        }
        for (auto& distance : row.distances) {
            std::string text;
            std::getline(fields, text, ',');
            distance = std::stod(text);
        }
    }
    return rows;
}

/// Distances of some materials of the built-in database by independent programs: of the summary in
/// float64, to nine digits; of window-log partly in float32.
TEST(Summary, TheLibraryIsThatOfItsGoldenValues) {
    const auto rows = golden_rows();
    ASSERT_EQ(rows.size(), 28U);
    const auto built_in = open_model("abc");
    std::vector<std::size_t> chosen;
    for (std::size_t m = 0; m < built_in->materials().size(); ++m) {
        if (std::ranges::any_of(rows, [&](const GoldenRow& row) {
                return std::ranges::find(row.materials, built_in->materials()[m]) !=
                       row.materials.end();
            })) {
            chosen.push_back(m);
        }
    }
    const auto database = make_subset(open_model("abc"), chosen);
    const std::array metrics = {open_metric("gloss-contrast:profile=0"),
                                open_metric("gloss-contrast"), open_metric("window-log")};
    std::vector<Metric> of_a_user;
    for (const auto& metric : metrics) {
        of_a_user.push_back(without_twin(metric));
    }
    std::vector<const Metric*> all;
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        all.push_back(&metrics[m]);
        all.push_back(&of_a_user[m]);
    }
    for (const bool in_shaders : {false, true}) {
        const auto found = compute_distances(test::engines(in_shaders), *database, all);
        for (std::size_t r = 0; r < rows.size(); ++r) {  // all pairs, in the order of pairs
            for (std::size_t m = 0; m < all.size(); ++m) {
                const double allowed = all[m]->is_summary() ? 1e-8 : 1e-5;
                EXPECT_NEAR(found.distances[m].values[r] / rows[r].distances[m / 2], 1, allowed)
                    << all[m]->name << " " << rows[r].materials[0] << " " << rows[r].materials[1];
            }
        }
    }
}

/// A summary of these lines as a user's file, computed; what is wrong with it.
std::string fault_of(const std::string& lines, const Database& database) {
    const Metric metric = test::metric_of(lines);
    const Metric* const one[] = {&metric};
    try {
        compute_distances(test::shader_engines(), database, one);
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(Summary, WhatIsWrongWithAFileIsNamed) {
    const FunctionDatabase database({.theta_h = 7, .theta_d = 6, .phi_d = 8}, 3,
                                    test::random_sample);
    const std::string header =
        "// window: all of it\n// features: 2\n// parameter: x = 0 in [0, 1] d\n";
    const std::string window = "float window(int w, Voxel v) { return 1.0; }\n";
    const std::string feature = "float feature(int i, Means m) { return m.rgb[all].x; }\n";
    EXPECT_EQ(fault_of(header + window + feature, database), "");
    const auto expect = [&](const std::string& lines, const std::vector<std::string>& parts) {
        const auto fault = fault_of(header + lines, database);
        for (const auto& part : parts) {
            EXPECT_NE(fault.find(part), std::string::npos) << fault << "\n" << part;
        }
    };
    for (const std::string wrong :
         {"v.cos_theta_i - 0.9", "1.0 / x", "log(-1.0 - v.s_merl)", "float(1 / int(x))", "-1.0"}) {
        expect("float window(int w, Voxel v) { return " + wrong + "; }\n" + feature,
               {"window(all, v) is ", "at voxel ", "theta_h"});
    }
    for (const std::string wrong :
         {"log(-1.0 - m.rgb[all].x)", "m.rgb[all].x / x", "m.rgb[i].x", "float(1 / int(x))"}) {
        expect(window + "float feature(int i, Means m) { return " + wrong + "; }\n",
               {"feature(", "material \"", "all ("});
    }
    expect(window +
               "float feature(int i, Means m) { float s = 0.0; for (;;) { s += 1.0; } return s; }",
           {"feature(0, m)", "goes wrong"});
    expect(feature, {"there is no \"float window(int w, Voxel v)\""});
    expect(window, {"there is no \"float feature(int i, Means m)\""});
    expect(window + "float feature(int i, Means m) { float s; return s; }",
           {"my.glsl:5: ", "before it has a value"});
    expect("float window(int w, Voxel v) { return float(gl_SubgroupSize); }\n" + feature,
           {"my.glsl:4: ", "gl_SubgroupSize"});
    expect(
        "float seen = 0.0;\nfloat window(int w, Voxel v) { seen += 1.0; return seen; }\n" + feature,
        {"\"seen\" is a variable of the whole file"});
    expect(window + "float feature(int i, Means m) { return 1e200 * m.rgb[all].x; }", {"beyond"});
}

/// Material 1 has no logarithm.
TEST(Summary, FeaturesAreThoseOfMaterialsInAPair) {
    const FunctionDatabase database({.theta_h = 3, .theta_d = 4, .phi_d = 8}, 40,
                                    [](std::size_t material, std::uint64_t, std::size_t) {
                                        return material == 1 ? 0
                                                             : static_cast<double>(material + 1);
                                    });
    const Metric metric = test::metric_of(
        "// window: all of it\n// features: 1\nfloat window(int w, Voxel v) { return 1.0; }\n"
        "float feature(int i, Means m) { return log(m.rgb[all].x); }\n");
    const Metric* const one[] = {&metric};
    const std::vector<MaterialPair> good = {{0, 2}, {3, 39}};
    const auto found =
        compute_distances(test::shader_engines(), database, one, {.pairs = good}).distances[0];
    EXPECT_NEAR(found.values[0], std::log(3.0), 1e-13);
    EXPECT_NEAR(found.values[1], std::log(10.0), 1e-13);
    const std::vector<MaterialPair> bad = {{0, 2}, {1, 3}};
    test::expect_refused(
        [&] { compute_distances(test::shader_engines(), database, one, {.pairs = bad}); },
        "feature(0, m) is ");
}

/// What a compiler makes of literals without another operand is a float, unless they are told to be
/// doubles: a tenth of a float is off by 1.5e-8 of itself.
TEST(Summary, LiteralsAreFloat64) {
    const FunctionDatabase database({.theta_h = 3, .theta_d = 4, .phi_d = 8}, 2,
                                    [](std::size_t material, std::uint64_t, std::size_t) {
                                        return 1.0 + static_cast<double>(material);
                                    });
    const std::string header = "// window: all of it\n// features: 1\n";
    const auto distance = [&](const std::string& lines) {
        const Metric metric = test::metric_of(header + lines);
        const Metric* const one[] = {&metric};
        return compute_distances(test::shader_engines(), database, one).distances[0].values[0];
    };
    const std::string window = "float window(int w, Voxel v) { return 1.0; }\n";
    for (const std::string tenth :
         {"(i == 0 ? 0.1 : 0.3)", "(i == 0 ? 0.1f : 0.3f)", "-(i == 0 ? -0.1 : 0.3)",
          "(i == 0 ? 1.0 / 10.0 : 0.3)", "max(i == 0 ? 0.1 : 0.3, 0.01)", "max(0.1, 0.01)",
          "tenth(i)", "vec3(i == 0 ? 0.1 : 0.3).y", "kTenth", "tenths[i]"}) {
        const std::string helpers =
            "const float kTenth = true ? 0.1 : 0.3;\nconst float tenths[2] = { 0.1, 0.3 };\n"
            "float tenth(int i) { return i == 0 ? (0.1) : 0.3; }\n";
        EXPECT_NEAR(distance(helpers + window + "float feature(int i, Means m) { return " + tenth +
                             " * m.rgb[all].y; }\n"),
                    0.1, 1e-15)
            << tenth;
    }
    EXPECT_NEAR(
        distance(window + "float feature(int i, Means m) { float sum = 1.0; sum += i == 0 ? "
                          "0.1 : 0.3; return (sum - 1.0) * m.rgb[all].y; }\n"),
        0.1, 1e-15);
    // Neither 0 nor infinite, as in float32.
    EXPECT_NEAR(distance(window + "float feature(int i, Means m) { return (i == 0 ? 1e300 : 0.0) * "
                                  "((i == 0 ? 1e-300 : 0.0) * m.rgb[all].y); }\n"),
                1, 1e-14);
    // A window of two parts that weigh 0.1 and 0.7, and a material that is 1 in the first of them.
    const FunctionDatabase halves({.theta_h = 1, .theta_d = 1, .phi_d = 2}, 2,
                                  [](std::size_t material, std::uint64_t voxel, std::size_t) {
                                      return material == 0 && voxel == 0 ? 1.0 : 0.0;
                                  });
    const Metric weighted =
        test::metric_of(header +
                        "float window(int w, Voxel v) { return v.phi_d < 1.0 ? 0.1 : 0.7; }\n"
                        "float feature(int i, Means m) { return m.rgb[all].y; }\n");
    const Metric* const one[] = {&weighted};
    EXPECT_NEAR(compute_distances(test::shader_engines(), halves, one).distances[0].values[0],
                0.125, 1e-15);
    // Of a metric over voxels, whose grid is float32 again: what is left is nothing, and
    // not 1.5e-9.
    const Metric over_voxels = test::metric_of(
        "// degree: 2\nvec3 transform(vec3 f, Voxel v) {\n"
        "    float tenth = 0.1;\n    return ((v.phi_d > 0.0 ? 0.1 : 0.3) - tenth) * f;\n}\n"
        "float weight(Voxel v) { return 1.0; }\nfloat difference(float d) { return d * d; }\n");
    const Metric* const other[] = {&over_voxels};
    EXPECT_EQ(compute_distances(test::shader_engines(), database, other).distances[0].values[0], 0);
}

/// A summary of these lines, computed in shaders, beside its features in long double.
void expect_within_bounds(const Metric& metric, const Database& database, double most,
                          long double (*feature)(const WindowMean& mean)) {
    const Metric* const one[] = {&metric};
    const auto found = compute_distances(test::shader_engines(), database, one).distances[0];
    std::size_t p = 0;
    for (std::size_t a = 0; a < database.materials().size(); ++a) {
        for (std::size_t b = a + 1; b < database.materials().size(); ++b, ++p) {
            const long double exact = std::abs(feature(found.means[a]) - feature(found.means[b]));
            EXPECT_LE(std::abs(found.values[p] - exact), found.bounds[p]) << a << " " << b;
            EXPECT_LT(found.bounds[p], most);
        }
    }
}

/// Dark materials, whose logarithms are of little but the constant, and cancel.
TEST(Summary, TheEstimateSeesWhatCancels) {
    const FunctionDatabase dark({.theta_h = 4, .theta_d = 4, .phi_d = 8}, 40,
                                [](std::size_t material, std::uint64_t, std::size_t channel) {
                                    return 1e-14 *
                                           std::abs(test::random_sample(material, 0, channel));
                                });
    expect_within_bounds(
        test::metric_of(
            "// window: whole all\n// features: 1\n"
            "float window(int w, Voxel v) { return 1.0; }\n"
            "float feature(int i, Means m) { vec3 c = m.rgb[whole]; return 10.0 * (0.5 * "
            "log(c.x + 1e-9) + 0.5 * log(c.y + 1e-9) - log(c.z + 1e-9)); }\n"),
        dark, 2e-12, [](const WindowMean& c) {
            return 10 * (0.5L * std::log(c[0] + 1e-9L) + 0.5L * std::log(c[1] + 1e-9L) -
                         std::log(c[2] + 1e-9L));
        });
}

/// Grey materials are at a corner of min(): downwards it is as steep as it gets. Means are off by
/// something like their bound here.
TEST(Summary, TheEstimateLooksBothWays) {
    const FunctionDatabase grey({.theta_h = 4, .theta_d = 4, .phi_d = 8}, 9,
                                [](std::size_t material, std::uint64_t, std::size_t) {
                                    return 0.1 + 0.07 * static_cast<double>(material);
                                });
    const Metric metric = test::metric_of(
        "// window: whole all\n// features: 1\nfloat window(int w, Voxel v) { return 1.0; }\n"
        "float feature(int i, Means m) { vec3 c = m.rgb[whole]; return 1000.0 * log(min(min(c.x, "
        "c.y), c.z)); }\n");
    expect_within_bounds(metric, grey, 1e-9, [](const WindowMean& c) {
        return 1000 * std::log(static_cast<long double>(std::min({c[0], c[1], c[2]})));
    });
    const Metric* const one[] = {&metric};
    const auto found = compute_distances(test::shader_engines(), grey, one).distances[0];
    for (const double bound : found.bounds) {
        EXPECT_GE(bound, 2e-11);  // 1e-14 of each of the two means
    }
}

/// The features of gloss-contrast from its formula, in long double, of means that are off by what
/// they may be off by.
std::vector<long double> gloss_contrast(const std::vector<double>& p,
                                        const std::vector<std::array<long double, 3>>& means) {
    const long double dark = p[0];
    const long double knee = p[1];
    const long double tint = p[7];
    const auto luminance = [&](std::size_t w) {
        return 0.212671 * means[w][0] + 0.715160 * means[w][1] + 0.072169 * means[w][2];
    };
    const auto& o = means[2];
    const auto [least, most] = std::minmax({o[0], o[1], o[2]});
    const auto hue = [&](std::size_t c) { return std::log(o[c] + tint); };
    std::vector<long double> z = {
        std::log((luminance(0) + dark) / (luminance(0) + knee)) +
            p[2] *
                std::log((luminance(1) + knee) / ((luminance(2) + knee) * (luminance(2) + dark))),
        p[3] * (most - least) / (most + dark), p[4] * std::log(luminance(1) + dark),
        p[5] * (hue(0) - hue(1)), p[6] * (hue(0) / 2 + hue(1) / 2 - hue(2))};
    for (std::size_t w = 3; w < 13; ++w) {
        z.push_back(std::sqrt(static_cast<long double>(p[8])) * std::log(luminance(w) + dark));
    }
    return z;
}

TEST(Summary, BoundsOfTheLibraryHold) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> unit(0, 1);
    const Metric& usual = find_metric("gloss-contrast");
    double nearest = 0;
    for (int trial = 0; trial < 3000; ++trial) {
        std::vector<double> parameters = usual.parameters;
        if (trial % 2 == 1) {  // anything, half of it at the ends
            for (std::size_t i = 0; i < parameters.size(); ++i) {
                const auto& p = usual.header.parameters[i];
                const double x = unit(random) < 0.5 ? std::round(unit(random)) : unit(random);
                parameters[i] = p.low > 0 ? p.low * std::pow(p.high / p.low, x) : x * p.high;
                parameters[i] = std::clamp(parameters[i], p.low, p.high);
            }
        }
        std::vector<WindowMean> means(13);
        std::vector<std::array<long double, 3>> exact(13);
        const double scale = std::pow(10, 16 * unit(random) - 13);
        const bool is_grey = trial % 3 == 0;
        for (std::size_t w = 0; w < means.size(); ++w) {
            for (std::size_t c = 0; c < 3; ++c) {
                means[w][c] = is_grey && c > 0   ? means[w][0]
                              : trial % 17 == 16 ? 0
                                                 : scale * unit(random);
                exact[w][c] = means[w][c] * (1 + 1e-14L * (2 * unit(random) - 1));
            }
        }
        std::vector<double> features(15);
        std::vector<double> errors(15);
        usual.twin.features(parameters, means, features);
        usual.twin.errors(parameters, means, 1e-14, errors);
        const auto expected = gloss_contrast(parameters, exact);
        for (std::size_t i = 0; i < features.size(); ++i) {
            const auto off = static_cast<double>(std::abs(features[i] - expected[i]));
            EXPECT_LE(off, errors[i]) << trial << " " << i;
            EXPECT_LT(errors[i], trial % 2 == 1 ? 1e-10 : 2e-13) << trial << " " << i;
            nearest = std::max(nearest, off / errors[i]);
        }
    }
    EXPECT_GT(nearest, 0.2);  // what is bounded is near the bound where all is at its worst
}

TEST(Summary, WeightsAreWithinTheRangeOfSums) {
    const FunctionDatabase database({.theta_h = 7, .theta_d = 6, .phi_d = 8}, 3,
                                    test::random_sample);
    const auto fault = [&](const std::string& weight) {
        return fault_of(
            "// window: all of it\n// features: 1\nfloat window(int w, Voxel v) { return " +
                weight + "; }\nfloat feature(int i, Means m) { return m.rgb[all].x; }\n",
            database);
    };
    EXPECT_EQ(fault("1e190"), "");
    EXPECT_EQ(fault("1e-190"), "");
    for (const std::string weight :
         {"1e-320", "1e-310 * (1.0 + v.theta_d)", "1e-210", "1e308", "1e210"}) {
        EXPECT_NE(fault(weight).find("the weights of its window \"all\" add up to "),
                  std::string::npos)
            << weight << ": " << fault(weight);
    }
}

TEST(Summary, WhatBelongsToOtherMetricsIsRefused) {
    const FunctionDatabase database({.theta_h = 7, .theta_d = 6, .phi_d = 8}, 3,
                                    test::random_sample);
    const std::string lines =
        "// window: all of it\n// features: 1\nfloat window(int w, Voxel v) { return 1.0; }\n"
        "float feature(int i, Means m) { return m.rgb[all].x; }\n";
    for (const auto& [name, function] :
         {std::pair<std::string, std::string>{"difference",
                                              "float difference(float d) { return d; }"},
          {"difference", "float difference(vec3 a, vec3 b) { return a.x - b.x; }"},
          {"weight", "float weight(Voxel v) { return 1.0; }"},
          {"transform", "vec3 transform(vec3 f, Voxel v) { return f; }"}}) {
        const auto fault = fault_of(lines + function, database);
        EXPECT_NE(fault.find("my.glsl:5: " + name + "() beside windows"), std::string::npos)
            << fault;
    }
    EXPECT_EQ(fault_of(lines + "float weight(float x) { return x; }", database), "");
    const auto returns = fault_of(
        "// window: all of it\n// features: 1\nfloat window(int w, Voxel v) { return 1.0; }\n"
        "int feature(int i, Means m) { return 1; }\n",
        database);
    EXPECT_NE(returns.find("my.glsl:4: "), std::string::npos) << returns;
    EXPECT_NE(returns.find("expected \"float feature(int i, Means m)\""), std::string::npos)
        << returns;
    for (const std::string name :
         {"float", "log", "half", "template", "theta_h_between", "input"}) {
        const auto fault = fault_of("// parameter: fine = 1 in [0, 2] p\n// window: " + name +
                                        " of it\n// features: 1\n#include \"lib/windows.glsl\"\n" +
                                        lines.substr(lines.find("float window")),
                                    database);
        EXPECT_NE(fault.find("my.glsl: \"" + name + "\" is a word of GLSL"), std::string::npos)
            << fault;
    }
    const auto parameter = fault_of("// parameter: float = 1 in [0, 2] p\n" + lines, database);
    EXPECT_NE(parameter.find("\"float\" is a word of GLSL"), std::string::npos) << parameter;
}

/// A window that only some voxels are in may be anywhere in a block, and of any weight.
TEST(Summary, OfAUserHasAnyWindow) {
    const FunctionDatabase database({.theta_h = 13, .theta_d = 11, .phi_d = 17}, 3,
                                    test::random_sample);
    const Metric metric = test::metric_of(
        "// window: one some\n// window: other the rest\n// features: 1\n"
        "float window(int w, Voxel v) {\n"
        "    bool some = int(v.phi_d * 1000.0) % 3 == 0;\n"
        "    return some == (w == one) ? v.cos_theta_i : 0.0;\n}\n"
        "float feature(int i, Means m) { return m.rgb[one].x + 2.0 * m.rgb[other].y; }\n");
    const Metric* const list[] = {&metric};
    const auto found = compute_distances(test::shader_engines(), database, list).distances[0];
    const Domain domain(database.grid());
    std::array<double, 3> features = {};
    for (std::size_t m = 0; m < features.size(); ++m) {
        std::array<double, 2> sums = {};
        std::array<double, 2> weights = {};
        for (std::uint64_t k = 0; k < database.grid().voxels(); ++k) {
            const Voxel v = domain.voxel(k);
            const std::size_t w = static_cast<int>(v.phi_d * 1000.0) % 3 == 0 ? 0 : 1;
            const double sample = test::random_sample(m, k, w);
            if (v.above_horizon() && sample >= 0) {
                sums[w] += v.cos_theta_i * sample;
                weights[w] += v.cos_theta_i;
            }
        }
        features[m] = sums[0] / weights[0] + 2 * sums[1] / weights[1];
    }
    EXPECT_NEAR(found.values[0], std::abs(features[0] - features[1]), 1e-11 * features[0]);
    EXPECT_NEAR(found.values[1], std::abs(features[0] - features[2]), 1e-11 * features[0]);
    EXPECT_NEAR(found.values[2], std::abs(features[1] - features[2]), 1e-11 * features[1]);
}

}  // namespace
}  // namespace merl::engine
