#include "engine/reflectance/metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "engine/error.h"

namespace merl::reflectance {
namespace {

TEST(Metric, TheLibraryHasFour) {
    std::string names;
    for (const auto& metric : metrics()) {
        names += std::string(metric.name) + " ";
        EXPECT_FALSE(metric.header("title").empty()) << metric.name;
        EXPECT_FALSE(metric.header("formula").empty()) << metric.name;
        EXPECT_FALSE(metric.header("source").empty()) << metric.name;
    }
    EXPECT_EQ(names, "cosine-rmse cwcbrt pawcielab rmse ");
}

TEST(Metric, HeaderGivesTheValueOfAKey) {
    const auto& metric = find_metric("cwcbrt");
    EXPECT_EQ(metric.header("degree"), "2/3");
    EXPECT_EQ(metric.header("deg"), "");
    EXPECT_EQ(metric.header("nothing"), "");
    EXPECT_TRUE(metric.per_channel);
    EXPECT_FALSE(framework_test_metrics()[0].per_channel);
}

TEST(Metric, AnUnknownOneIsRefusedWithTheNamesThereAre) {
    try {
        find_metric("cielab");
        FAIL();
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::usage);
        EXPECT_STREQ(error.what(),
                     "there is no metric \"cielab\"; the metrics are: cosine-rmse, "
                     "cwcbrt, pawcielab, rmse");
    }
}

/// CIELAB of the primaries of sRGB under D65, as tabulated by B. Lindbloom to two decimals; RGB is
/// not scaled (SPEC §3), so 100 is white.
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
        const Rgb lab = find_metric("pawcielab").twin.transform(row.rgb, {});
        for (std::size_t i = 0; i < 3; ++i) {
            EXPECT_NEAR(lab[i], row.lab[i], 0.02)
                << row.rgb[0] << " " << row.rgb[1] << " " << row.rgb[2];
        }
    }
}

TEST(Metric, CielabIsLinearNearBlack) {
    // Below the knee of F, L = 116 · 841/108 · Y/100 (SPEC §3).
    const Rgb lab = find_metric("pawcielab").twin.transform({0.1, 0.1, 0.1}, {});
    EXPECT_NEAR(lab[0], 116 * (841.0 / 108.0) * 0.1 / 100, 1e-12);
}

TEST(Metric, WeightsAndSumsAreThoseOfTheSpecification) {
    const Voxel v = {.theta_h = 0,
                     .theta_d = 0,
                     .phi_d = 0,
                     .cos_theta_i = 0.3,
                     .cos_theta_o = 0.7,
                     .s_merl = 5};
    const std::vector<Rgb> a = {{1, 2, 3}};
    const std::vector<Rgb> b = {{1.5, 0, 11}};
    const std::vector<double> one = {1.0};
    const auto twin = [](const char* name) { return find_metric(name).twin; };
    EXPECT_DOUBLE_EQ(twin("rmse").weight(v), 1);
    EXPECT_DOUBLE_EQ(twin("cosine-rmse").weight(v), 0.09);
    EXPECT_DOUBLE_EQ(twin("cwcbrt").weight(v), std::cbrt(0.09));
    EXPECT_DOUBLE_EQ(twin("pawcielab").weight(v), 0.3 * 0.7 * 5);
    EXPECT_DOUBLE_EQ(twin("rmse").sum(a, b, one), 0.25 + 4 + 64);
    EXPECT_DOUBLE_EQ(twin("cwcbrt").sum(a, b, one), std::cbrt(0.25) + std::cbrt(4.0) + 4);
}

}  // namespace
}  // namespace merl::reflectance
