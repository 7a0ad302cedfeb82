#include "engine/database/domain.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/mat4x4.hpp>
#include <glm/vec3.hpp>
#include <numbers>

namespace merl::engine {
namespace {

using std::numbers::pi;

/// The incident direction from half-difference angles, by rotating the normal (Rusinkiewicz 1998):
/// independent of the closed form that the program uses.
glm::dvec3 rotated(double theta_h, double theta_d, double phi_d) {
    glm::dmat4 m(1.0);
    m = glm::rotate(m, theta_h, glm::dvec3(0, 1, 0));
    m = glm::rotate(m, phi_d, glm::dvec3(0, 0, 1));
    m = glm::rotate(m, theta_d, glm::dvec3(0, 1, 0));
    return glm::dvec3(m * glm::dvec4(0, 0, 1, 0));
}

TEST(Domain, CosinesAreThoseOfRotatedDirections) {
    const Domain domain({.theta_h = 7, .theta_d = 5, .phi_d = 6});
    for (std::uint64_t i = 0; i < domain.grid().voxels(); ++i) {
        const Voxel v = domain.voxel(i);
        EXPECT_NEAR(v.cos_theta_i, rotated(v.theta_h, v.theta_d, v.phi_d).z, 1e-14);
        EXPECT_NEAR(v.cos_theta_o, rotated(v.theta_h, -v.theta_d, v.phi_d).z, 1e-14);
    }
}

TEST(Domain, VoxelsStandAtTheirCentresInFileOrder) {
    const Domain domain(Grid{});
    const Voxel v = domain.voxel(17 + 180 * (42 + 90 * 63));
    EXPECT_DOUBLE_EQ(v.phi_d, pi * 17.5 / 180);
    EXPECT_DOUBLE_EQ(v.theta_d, pi / 2 * 42.5 / 90);
    EXPECT_DOUBLE_EQ(v.theta_h, pi / 2 * (63.5 / 90) * (63.5 / 90));
}

TEST(Domain, ScaleFactorDoesNotDependOnPhi) {
    const Voxel at_zero = Domain::at(0, 0.3, 0.8);
    const Voxel at_half = Domain::at(0.5, 0.3, 0.8);
    EXPECT_DOUBLE_EQ(at_zero.s_merl, at_half.s_merl);
    const double theta_h = pi / 2 * 0.64;
    const double theta_d = pi / 2 * 0.3;
    EXPECT_NEAR(
        at_zero.s_merl,
        pi * pi * pi / 2 * 0.8 * 4 * std::sin(theta_h) * std::sin(theta_d) * std::cos(theta_d),
        1e-12);
}

TEST(Domain, ScaleFactorIntegratesToBothHemispheres) {
    // Ryman 2018, table 4.2: the mean of s_MERL above the horizon is pi, in the limit.
    const Domain domain({.theta_h = 180, .theta_d = 180, .phi_d = 360});
    double sum = 0;
    for (std::uint64_t i = 0; i < domain.grid().voxels(); ++i) {
        const Voxel v = domain.voxel(i);
        sum += v.above_horizon() ? v.s_merl : 0;
    }
    EXPECT_NEAR(sum / static_cast<double>(domain.grid().voxels()), pi, 2e-4);
}

TEST(VoxelList, CountsTheVoxelsAboveTheHorizon) {
    const Domain domain(Grid{});
    EXPECT_EQ(VoxelList(domain, VoxelSet::above_horizon).size(), 1'096'216U);
    EXPECT_EQ(VoxelList(domain, VoxelSet::all).size(), 1'458'000U);
}

TEST(VoxelList, RunsOfAnyPartAreThePartOfAllRuns) {
    const Domain domain({.theta_h = 9, .theta_d = 8, .phi_d = 11});
    const VoxelList list(domain, VoxelSet::above_horizon);
    std::vector<std::uint64_t> expected;
    for (std::uint64_t i = 0; i < domain.grid().voxels(); ++i) {
        if (domain.voxel(i).above_horizon()) {
            expected.push_back(i);
        }
    }
    ASSERT_EQ(list.size(), expected.size());
    for (const std::uint64_t step : {1U, 7U, 64U, 10000U}) {
        std::vector<std::uint64_t> got;
        for (std::uint64_t first = 0; first < list.size(); first += step) {
            const std::uint64_t last = std::min(first + step, list.size());
            for (const auto& run : list.runs(first, last)) {
                EXPECT_EQ(run.position, got.size());
                for (std::uint64_t i = 0; i < run.length; ++i) {
                    got.push_back(run.file_index + i);
                }
            }
            EXPECT_EQ(got.size(), last);
        }
        EXPECT_EQ(got, expected);
    }
}

TEST(Domain, ARowIsItsVoxels) {
    const Domain domain({.theta_h = 3, .theta_d = 4, .phi_d = 9});
    std::array<Voxel, 5> row;
    for (const std::uint64_t first : {0U, 4U, 9U, 13U, 3U * 4U * 9U - 5U}) {
        domain.row(first, row);
        for (std::size_t k = 0; k < row.size(); ++k) {
            const Voxel expected = domain.voxel(first + k);
            EXPECT_EQ(row[k].theta_h, expected.theta_h);
            EXPECT_EQ(row[k].theta_d, expected.theta_d);
            EXPECT_EQ(row[k].phi_d, expected.phi_d);
            EXPECT_EQ(row[k].cos_theta_i, expected.cos_theta_i);
            EXPECT_EQ(row[k].cos_theta_o, expected.cos_theta_o);
            EXPECT_EQ(row[k].s_merl, expected.s_merl);
            EXPECT_EQ(row[k].solid_angle, expected.solid_angle);
            EXPECT_EQ(row[k].voxels, expected.voxels);
            EXPECT_EQ(row[k].theta_h_layer, expected.theta_h_layer);
            EXPECT_EQ(row[k].theta_d_layers, expected.theta_d_layers);
        }
    }
}

}  // namespace
}  // namespace merl::engine
