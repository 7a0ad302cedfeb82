#include "engine/metric/metric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using Rgb = std::array<double, 3>;

TEST(Metric, TheLibrary) {
    std::string names;
    for (const auto& metric : metrics()) {
        names += metric.name + " ";
        EXPECT_FALSE(metric.header.title.empty()) << metric.name;
        EXPECT_FALSE(metric.header.formula.empty()) << metric.name;
        EXPECT_FALSE(metric.header.source.empty()) << metric.name;
    }
    EXPECT_EQ(
        names,
        "bieron-l2 bieron-log cosine-rmse cube-root cwcbrt gloss-contrast low-log nbrdf-loss ngan "
        "nielsen-log paw-ciede2000 pawcielab rmse sun-log2 window-log ");
}

TEST(Metric, TheDegreeDecidesOnBounds) {
    EXPECT_TRUE(find_metric("cwcbrt").has_slopes());
    EXPECT_FALSE(find_metric("rmse").has_slopes());
    EXPECT_FALSE(framework_test_metrics()[0].has_bound());
}

TEST(Metric, AnUnknownOneIsRefusedWithTheNamesThereAre) {
    try {
        find_metric("cielab");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::usage);
        EXPECT_STREQ(
            error.what(),
            "there is no metric \"cielab\"; the metrics are: bieron-l2, bieron-log, cosine-rmse, "
            "cube-root, cwcbrt, gloss-contrast, low-log, nbrdf-loss, ngan, nielsen-log, "
            "paw-ciede2000, pawcielab, rmse, sun-log2, window-log; a file of your own ends in "
            ".glsl");
    }
}

void expect_refused(const std::string& text, Fault fault, const std::string& part) {
    try {
        open_metric(text);
        FAIL() << text;
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), fault) << error.what();
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
}

TEST(Metric, ParametersAreInTheNameUnlessTheyAreDefaults) {
    EXPECT_EQ(open_metric("rmse").name, "rmse");
    EXPECT_EQ(open_metric("pawcielab:white=100").name, "pawcielab");
    const auto metric = open_metric("pawcielab:white=2.50e1");
    EXPECT_EQ(metric.name, "pawcielab:white=25");
    EXPECT_EQ(metric.parameters, std::vector<double>{25});
    EXPECT_EQ(find_metric("pawcielab").parameters, std::vector<double>{100});
}

TEST(Metric, WrongParametersAreRefused) {
    expect_refused("rmse:white=1", Fault::usage, "no parameter \"white\"; it has none at all");
    expect_refused("pawcielab:black=1", Fault::usage, "its parameters are: white");
    expect_refused("pawcielab:", Fault::usage, "no parameter \"\"");
    expect_refused("pawcielab:white=1:white=1", Fault::usage, "given twice");
    for (const char* value : {"", "=", "=x", "=0", "=-1", "=1e9", "=nan", "=inf", "=1 ", "=1,2"}) {
        expect_refused(std::string("pawcielab:white") + value, Fault::usage, "expected a number");
    }
}

TEST(Metric, AFileOfYourOwn) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "a:b.glsl";
    std::ofstream(path) << "// degree: 1\n// parameter: alpha = 0.5 in [0, 1] how much\n";
    const auto metric = open_metric(path.string() + ":alpha=0.3");
    EXPECT_EQ(metric.name, "a:b.glsl:alpha=0.3");
    EXPECT_EQ(metric.file, path.string());
    EXPECT_EQ(metric.header.degree, 1);
    EXPECT_FALSE(metric.has_twin());
    EXPECT_EQ(open_metric(path.string()).parameters, std::vector<double>{0.5});

    expect_refused((directory.path / "none.glsl").string(), Fault::input, "No such file");
    expect_refused(".glsl", Fault::input, "No such file");
    std::filesystem::create_directory(directory.path / "d.glsl");
    expect_refused((directory.path / "d.glsl").string(), Fault::input, "not a regular file");
    std::ofstream(directory.path / "big.glsl") << std::string(300'000, ' ');
    expect_refused((directory.path / "big.glsl").string(), Fault::input, "more than");
    std::ofstream(directory.path / "utf16.glsl") << std::string("\xff\xfe/\0/\0", 6);
    expect_refused((directory.path / "utf16.glsl").string(), Fault::input, "UTF-16");
    std::ofstream(directory.path / "zero.glsl") << std::string(3, '\0');
    expect_refused((directory.path / "zero.glsl").string(), Fault::input, "zero byte");
}

/// A byte order mark, and lines that end as on other systems.
TEST(Metric, AFileFromAnyEditor) {
    const test::TemporaryDirectory directory;
    const std::string text = "// title: A\n// degree: 1\n\nfloat x;\n";
    for (const std::string end : {"\n", "\r\n", "\r"}) {
        for (const std::string mark : {"", "\xef\xbb\xbf"}) {
            std::string other = mark;
            for (const char c : text) {
                other += c == '\n' ? end : std::string(1, c);
            }
            std::ofstream(directory.path / "M.GLSL", std::ios::binary) << other;
            const auto metric = open_metric((directory.path / "M.GLSL").string());
            EXPECT_EQ(metric.source, text);
            EXPECT_EQ(metric.header.title, "A");
            EXPECT_EQ(metric.header.degree, 1);
            EXPECT_EQ(metric.name, "M.GLSL");
        }
    }
    expect_refused((directory.path / "none.GlSl").string(), Fault::input, "No such file");
}

/// The transform of one sample.
Rgb transformed(const Metric& metric, const Rgb& rgb, const Voxel& voxel = {}) {
    const std::vector<Voxel> voxels(kBlockVoxels, voxel);
    auto samples = std::make_unique<BlockSamples>();
    for (std::size_t i = 0; i < 3; ++i) {
        (*samples)[i][7] = rgb[i];
    }
    auto result = std::make_unique<BlockSamples>();
    metric.twin.transform(metric.parameters, std::span<const Voxel, kBlockVoxels>(voxels), *samples,
                          *result);
    return {(*result)[0][7], (*result)[1][7], (*result)[2][7]};
}

/// The weight of one voxel.
double weight(const Metric& metric, const Voxel& voxel) {
    const std::vector<Voxel> voxels(kBlockVoxels, voxel);
    BlockWeights weights = {};
    metric.twin.weigh(metric.parameters, std::span<const Voxel, kBlockVoxels>(voxels), weights);
    return weights[3];
}

/// The sum over a block in which all but one difference are zero.
double sum_of(const Metric& metric, const Rgb& a, const Rgb& b) {
    auto x = std::make_unique<BlockSamples>();
    auto y = std::make_unique<BlockSamples>();
    for (std::size_t i = 0; i < 3; ++i) {
        (*x)[i][1001] = a[i];
        (*y)[i][1001] = b[i];
    }
    BlockWeights weights;
    weights.fill(1);
    return metric.twin.sum(metric.parameters, *x, *y, weights);
}

/// The twins' cube root, in the whole range of float64.
TEST(Metric, CubeRootsOfEveryExponent) {
    const auto& roots = find_metric("cube-root");
    const auto& powers = find_metric("cwcbrt");
    const Voxel voxel = {.cos_theta_i = 1};
    for (int exponent = -1022; exponent < 1024; ++exponent) {
        const Rgb x = {std::ldexp(1.0, exponent), std::ldexp(1.2345678901234567, exponent),
                       std::ldexp(1.9999999999999998, exponent)};
        const Rgb root = transformed(roots, x, voxel);
        for (std::size_t i = 0; i < 3; ++i) {
            const long double exact = std::cbrt(static_cast<long double>(x[i]));
            EXPECT_LT(std::abs(root[i] / exact - 1), 4e-16L) << x[i];
            const long double power = sum_of(powers, {x[i], 0, 0}, {0, 0, 0});
            EXPECT_LT(std::abs(power / (exact * exact) - 1), 1e-15L) << x[i];
        }
    }
    for (const double root : transformed(roots, {0, 0x1p-1074, 0x1.fp-1023}, voxel)) {
        EXPECT_GE(root, 0);
        EXPECT_LT(root, 1e-102);
    }
}

/// CIELAB of the primaries of sRGB under D65, as tabulated by B. Lindbloom to two decimals; RGB is
/// not scaled, so 100 is white.
TEST(Metric, PawcielabTransformsToPublishedCielab) {
    struct Row {
        Rgb rgb, lab;
    };
    const Row rows[] = {
        {{100, 100, 100}, {100, 0, 0}},          {{100, 0, 0}, {53.24, 80.09, 67.20}},
        {{0, 100, 0}, {87.73, -86.18, 83.18}},   {{0, 0, 100}, {32.30, 79.19, -107.86}},
        {{100, 100, 0}, {97.14, -21.55, 94.48}}, {{0, 100, 100}, {91.11, -48.09, -14.13}},
        {{100, 0, 100}, {60.32, 98.23, -60.82}}, {{0, 0, 0}, {0, 0, 0}},
    };
    for (const auto& row : rows) {
        const Rgb lab = transformed(find_metric("pawcielab"), row.rgb);
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_NEAR(lab[i], row.lab[i], 0.02)
                << row.rgb[0] << " " << row.rgb[1] << " " << row.rgb[2];
        }
    }
}

TEST(Metric, PawcielabsWhiteScalesTheSamples) {
    const auto metric = open_metric("pawcielab:white=2");
    const Rgb lab = transformed(metric, {2, 0, 0});
    const Rgb red = transformed(find_metric("pawcielab"), {100, 0, 0});
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_NEAR(lab[i], red[i], 1e-12);
    }
}

TEST(Metric, CielabIsLinearNearBlack) {
    // Below the knee of F, L = 116 · 841/108 · Y/100 (Ryman 2018, 4.28).
    const Rgb lab = transformed(find_metric("pawcielab"), {0.1, 0.1, 0.1});
    EXPECT_NEAR(lab[0], 116 * (841.0 / 108.0) * 0.1 / 100, 1e-12);
}

/// Pairs of the test data of Sharma, Wu and Dalal 2005 (table 1): the hue differences are small,
/// about 180 degrees and on both sides of it, or undefined; then large differences, and measured
/// colours.
TEST(Metric, Ciede2000IsThatOfThePublishedPairs) {
    struct Row {
        Rgb a, b;
        double difference;
    };
    const Row rows[] = {
        {{50, 2.6772, -79.7751}, {50, 0, -82.7485}, 2.0425},
        {{50, -1.3802, -84.2814}, {50, 0, -82.7485}, 1.0000},
        {{50, 0, 0}, {50, -1, 2}, 2.3669},
        {{50, 2.49, -0.001}, {50, -2.49, 0.0009}, 7.1792},
        {{50, 2.49, -0.001}, {50, -2.49, 0.0010}, 7.1792},
        {{50, 2.49, -0.001}, {50, -2.49, 0.0011}, 7.2195},
        {{50, -0.001, 2.49}, {50, 0.0009, -2.49}, 4.8045},
        {{50, -0.001, 2.49}, {50, 0.0011, -2.49}, 4.7461},
        {{50, 2.5, 0}, {50, 0, -2.5}, 4.3065},
        {{50, 2.5, 0}, {73, 25, -18}, 27.1492},
        {{50, 2.5, 0}, {61, -5, 29}, 22.8977},
        {{50, 2.5, 0}, {56, -27, -3}, 31.9030},
        {{60.2574, -34.0099, 36.2677}, {60.4626, -34.1751, 39.4387}, 1.2644},
        {{61.2901, 3.7196, -5.3901}, {61.4292, 2.2480, -4.9620}, 1.8731},
        {{35.0831, -44.1164, 3.7933}, {35.0232, -40.0716, 1.5901}, 1.8645},
        {{90.8027, -2.0831, 1.4410}, {91.1528, -1.6435, 0.0447}, 1.4441},
        {{6.7747, -0.2908, -2.4247}, {5.8714, -0.0985, -2.2286}, 0.6377},
    };
    const auto& metric = find_metric("paw-ciede2000");
    for (const auto& row : rows) {
        EXPECT_NEAR(std::sqrt(sum_of(metric, row.a, row.b)), row.difference, 5.1e-5);
        EXPECT_NEAR(std::sqrt(sum_of(metric, row.b, row.a)), row.difference, 5.1e-5);
    }
}

/// The formulas in the files' headers, computed in Python: g·h at a voxel with cos theta_i = 0.3,
/// cos theta_o = 0.7 and s_MERL = 5, for samples of 2 and 0.5 in one channel.
TEST(Metric, TheLibraryIsThatOfItsFormulas) {
    const Voxel v = {.theta_h = 0.3,
                     .theta_d = 0.4,
                     .phi_d = 1,
                     .s_merl = 5,
                     .cos_theta_i = 0.3,
                     .cos_theta_o = 0.7};
    const std::pair<const char*, double> rows[] = {
        {"cube-root", 0.09740852025088818},  {"ngan", 0.322288759761088},
        {"low-log", 0.7635697314506094},     {"bieron-l2", 0.70875},
        {"bieron-log", 0.38170850111493476}, {"sun-log2", 3.959128814194094},
        {"nielsen-log", 1.9021753712699476}, {"sun-log2:epsilon=0.5", 0.3656605404970981},
        {"nbrdf-loss", 0.11008056229019232},
    };
    for (const auto& [name, expected] : rows) {
        const auto metric = open_metric(name);
        const Rgb a = transformed(metric, {2, 0, 0}, v);
        const Rgb b = transformed(metric, {0.5, 0, 0}, v);
        EXPECT_NEAR(weight(metric, v) * sum_of(metric, a, b) / expected, 1, 1e-12) << name;
    }
    EXPECT_EQ(weight(open_metric("ngan:largest_angle=60"), v), 0);
    EXPECT_EQ(weight(find_metric("ngan"), v), 5 / 3.14159265358979324);  // no digit is lost
}

/// The floor of Nielsen's cosine factor is a parameter of its own: 0.001 as it always was, 0.01 as
/// the authors have it, whatever epsilon is. Expected values computed in Python.
TEST(Metric, NielsensClipping) {
    struct Row {
        const char* name;
        double at_two_thousandths;  // cos theta_i cos theta_o
        double at_two_ten_thousandths;
    };
    const Row rows[] = {
        {"nielsen-log", 0.8395887053184748, 0.4804530139182014},
        {"nielsen-log:clip=0.01", 1.5694150552333266, 1.5694150552333266},
        {"nielsen-log:clip=0", 0.8395887053184748, 0.058159137648151935},
        {"nielsen-log:epsilon=0.5", 3.564289384673932e-05, 8.955181555115102e-06},
        {"nielsen-log:epsilon=0.5:clip=0.01", 0.0008567552799947823, 0.0008567552799947823},
    };
    const auto distance = [](const Metric& metric, const Voxel& v) {
        const Rgb a = transformed(metric, {2, 0, 0}, v);
        const Rgb b = transformed(metric, {0.5, 0, 0}, v);
        return weight(metric, v) * sum_of(metric, a, b);
    };
    for (const auto& row : rows) {
        const auto metric = open_metric(row.name);
        EXPECT_NEAR(
            distance(metric, {.cos_theta_i = 0.04, .cos_theta_o = 0.05}) / row.at_two_thousandths,
            1, 1e-12)
            << row.name;
        EXPECT_NEAR(distance(metric, {.cos_theta_i = 0.01, .cos_theta_o = 0.02}) /
                        row.at_two_ten_thousandths,
                    1, 1e-12)
            << row.name;
    }
    // The same numbers as of sun-log2, whose floor is a constant.
    const Voxel low = {.cos_theta_i = 0.01, .cos_theta_o = 0.02};
    const double natural = transformed(find_metric("nielsen-log"), {2, 0, 0}, low)[0];
    EXPECT_EQ(natural * 1.44269504088896341,
              transformed(find_metric("sun-log2"), {2, 0, 0}, low)[0]);
}

/// Ngan's weights are shares of the solid angle, whatever is left out of it: they have mean 1. So
/// the distance of two materials that differ by 1 in one channel, times the cosine, does not depend
/// on it.
TEST(Metric, NgansWeightsAddUpToOne) {
    const Domain domain({.theta_h = 90, .theta_d = 90, .phi_d = 180});
    for (const auto& [name, error] : {std::pair("ngan", 2e-3),
                                      {"ngan:largest_angle=80", 2e-3},
                                      {"ngan:largest_angle=60", 2e-3},
                                      {"ngan:largest_angle=30", 5e-3},
                                      {"ngan:largest_angle=10", 0.03}}) {
        const auto metric = open_metric(name);
        double sum = 0;
        for (std::uint64_t first = 0; first < domain.grid().voxels(); first += kBlockVoxels) {
            std::vector<Voxel> block(kBlockVoxels);
            for (std::uint64_t i = first;
                 i < std::min(first + kBlockVoxels, domain.grid().voxels()); ++i) {
                block[i - first] = domain.voxel(i);
            }
            BlockWeights weights = {};
            metric.twin.weigh(metric.parameters, std::span<const Voxel, kBlockVoxels>(block),
                              weights);
            for (std::uint64_t i = 0; i < kBlockVoxels; ++i) {
                sum += block[i].above_horizon() ? weights[i] : 0;
            }
        }
        EXPECT_NEAR(sum / static_cast<double>(domain.grid().voxels()), 1, error) << name;
    }
}

TEST(Metric, TheFloorOfLowsSineIsInItsFormula) {
    const Voxel above = {.s_merl = 5, .cos_theta_i = 1, .cos_theta_o = 1};
    EXPECT_DOUBLE_EQ(weight(find_metric("low-log"), above), 5 / 1e-3);
    EXPECT_NE(find_metric("low-log").header.formula.find("max(sin theta_o, 10^-3)"),
              std::string::npos);
}

TEST(Metric, WeightsAndSumsAreThoseOfTheSpecification) {
    const Voxel v = {.theta_h = 0,
                     .theta_d = 0,
                     .phi_d = 0,
                     .s_merl = 5,
                     .cos_theta_i = 0.3,
                     .cos_theta_o = 0.7};
    EXPECT_DOUBLE_EQ(weight(find_metric("rmse"), v), 1);
    EXPECT_DOUBLE_EQ(weight(find_metric("cosine-rmse"), v), 0.09);
    EXPECT_NEAR(weight(find_metric("cwcbrt"), v), std::cbrt(0.09), 1e-15);
    EXPECT_DOUBLE_EQ(weight(find_metric("pawcielab"), v), 0.3 * 0.7 * 5);
    const Rgb a = {1, 2, 3};
    const Rgb b = {1.5, 0, 11};
    EXPECT_DOUBLE_EQ(sum_of(find_metric("rmse"), a, b), 0.25 + 4 + 64);
    EXPECT_NEAR(sum_of(find_metric("cwcbrt"), a, b), std::cbrt(0.25) + std::cbrt(4.0) + 4, 1e-14);
}

}  // namespace
}  // namespace merl::engine
