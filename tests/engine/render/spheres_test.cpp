#include "engine/render/spheres.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "engine/device/shader_compiler.h"
#include "engine/distance/parts/slab_reader.h"
#include "tests/engine/other_device.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using std::numbers::pi;

constexpr Grid kGrid = {.theta_h = 5, .theta_d = 4, .phi_d = 6};

/// Materials that reflect the same in all directions: red, green and blue 1, 2 and 3 times a
/// number.
test::FunctionDatabase lambertian() {
    return {kGrid, 3, [](std::size_t material, std::uint64_t, std::size_t channel) {
                return static_cast<double>(material + 1) * static_cast<double>(channel + 1) / pi;
            }};
}

struct Rendered {
    std::size_t material, light;
    std::vector<SpherePixel> pixels;
};

std::vector<Rendered> render(device::Context& context, const Database& database,
                             const std::vector<std::size_t>& materials,
                             const SphereOptions& options) {
    std::vector<Rendered> images;
    render_spheres(context, database, materials, options, [&](const SphereImage& image) {
        images.push_back({image.material, image.light, {image.pixels.begin(), image.pixels.end()}});
    });
    return images;
}

/// What a pixel of the Lambertian sphere of albedo 1 shows, by 16 × 16 rays in float64: n·l / π and
/// the share covered. Intersects by the quadratic formula, unlike the shader.
std::array<double, 2> closed_form(std::uint32_t x, std::uint32_t y, const SphereOptions& options,
                                  std::array<double, 3> light) {
    const double half = std::tan(options.field_of_view * pi / 360);
    const double camera = std::sqrt(1 + 1 / std::pow(0.9 * half, 2));
    const double norm = std::hypot(light[0], light[1], light[2]);
    constexpr int kRays = 16;
    std::array<double, 2> sum = {};
    for (int i = 0; i < kRays * kRays; ++i) {
        const double u = (2 * (x + (i % kRays + 0.5) / kRays) / options.size - 1) * half;
        const double v = (1 - 2 * (y + (i / kRays + 0.5) / kRays) / options.size) * half;
        // |(t u, t v, camera - t)|² = 1
        const double a = u * u + v * v + 1;
        const double root = camera * camera - a * (camera * camera - 1);
        if (root >= 0) {
            const double t = (camera - std::sqrt(root)) / a;
            const double cosine =
                (t * u * light[0] + t * v * light[1] + (camera - t) * light[2]) / norm;
            sum[0] += std::max(0.0, cosine) / pi;
            sum[1] += 1;
        }
    }
    return {sum[0] / (kRays * kRays), sum[1] / (kRays * kRays)};
}

void expect_closed_form(const Rendered& image, double albedo, const SphereOptions& options) {
    double covered = 0;
    for (std::uint32_t y = 0; y < options.size; ++y) {
        for (std::uint32_t x = 0; x < options.size; ++x) {
            const auto& pixel = image.pixels[y * options.size + x];
            const auto [radiance, share] = closed_form(x, y, options, options.lights[image.light]);
            const bool edge = share > 0 && share < 1;
            // 16 samples of a pixel on the silhouette; elsewhere the shading's curvature is left.
            const double allowed = edge ? 0.12 : 1.5 / options.size / options.size + 1e-6;
            ASSERT_NEAR(pixel[3], share, edge ? 0.12 : 1e-6) << x << ' ' << y;
            for (std::size_t c = 0; c < 3; ++c) {
                const double scale = albedo * static_cast<double>(c + 1);
                // Where the shadow begins inside a pixel, 4 samples know it to a quarter of a step.
                ASSERT_NEAR(pixel[c] / scale, radiance, allowed + (radiance < 0.02 ? 2e-3 : 0))
                    << x << ' ' << y;
            }
            covered += pixel[3];
        }
    }
    // Nine tenths of the height, so this share of the square.
    const double disc = pi / 4 * 0.81;
    EXPECT_NEAR(covered / (options.size * options.size), disc, 2e-3);
}

TEST(Spheres, LambertianIsTheClosedForm) {
    const SphereOptions options = {
        .size = 61, .field_of_view = 60, .lights = {{1, 1, 1}, {-3, 0.5, -1}, {0, 0, 2}}};
    const auto images = render(test::lavapipe(), lambertian(), {2, 0, 1}, options);
    ASSERT_EQ(images.size(), 9U);
    const std::array<double, 3> albedos = {3, 1, 2};
    for (std::size_t i = 0; i < images.size(); ++i) {
        EXPECT_EQ(images[i].material, i / 3);
        EXPECT_EQ(images[i].light, i % 3);
        expect_closed_form(images[i], albedos[i / 3], options);
    }
}

TEST(Spheres, ClosedFormForNarrowAndWideFieldsOfView) {
    for (const double degrees : {1.0, 20.0, 150.0}) {
        const SphereOptions options = {.size = 40, .field_of_view = degrees, .lights = {{1, 1, 1}}};
        const auto images = render(test::lavapipe(), lambertian(), {0}, options);
        ASSERT_EQ(images.size(), 1U);
        if (degrees < 100) {  // beyond, the sphere is so near that few pixels see most of it
            expect_closed_form(images[0], 1, options);
        }
        for (const auto& pixel : images[0].pixels) {
            for (const float value : pixel) {
                ASSERT_TRUE(std::isfinite(value) && value >= 0);
            }
        }
    }
}

TEST(Spheres, OverTwoPiLightAndEyeAreTold) {
    // Three times as bright where phi_d is beyond pi, which is where light.(n x h) is negative.
    const Grid grid = {.theta_h = 8, .theta_d = 6, .phi_d = 400, .phi_d_range = PhiDRange::two_pi};
    const test::FunctionDatabase database(grid, 1, [](std::size_t, std::uint64_t v, std::size_t) {
        return (v % 400 < 200 ? 1 : 3) / pi;
    });
    const SphereOptions options = {.size = 41, .field_of_view = 60, .lights = {{1, 1, 1}}};
    const auto image = render(test::lavapipe(), database, {0}, options).at(0);
    const double half = std::tan(options.field_of_view * pi / 360);
    const double camera = std::sqrt(1 + 1 / std::pow(0.9 * half, 2));
    std::array<int, 2> seen = {};
    for (std::uint32_t y = 0; y < options.size; ++y) {
        for (std::uint32_t x = 0; x < options.size; ++x) {
            const auto [lambertian, share] = closed_form(x, y, options, options.lights[0]);
            const double u = (2 * (x + 0.5) / options.size - 1) * half;
            const double v = (1 - 2 * (y + 0.5) / options.size) * half;
            const double a = u * u + v * v + 1;
            const double root = camera * camera - a * (camera * camera - 1);
            if (share < 1 || lambertian < 0.05 || root < 0) {
                continue;
            }
            const double t = (camera - std::sqrt(root)) / a;
            const std::array<double, 3> n = {t * u, t * v, camera - t};
            const double eye_norm = std::hypot(-u, -v, 1.0);
            std::array<double, 3> h = {-u / eye_norm, -v / eye_norm, 1 / eye_norm};
            for (double& component : h) {
                component += 1 / std::sqrt(3.0);
            }
            const double triple = (n[1] * h[2] - n[2] * h[1]) + (n[2] * h[0] - n[0] * h[2]) +
                                  (n[0] * h[1] - n[1] * h[0]);
            if (std::abs(triple) < 0.1) {
                continue;  // the border may go through the pixel
            }
            ++seen[triple > 0 ? 0 : 1];
            ASSERT_NEAR(image.pixels[y * options.size + x][0] / lambertian, triple > 0 ? 1 : 3,
                        0.02)
                << x << ' ' << y;
        }
    }
    EXPECT_GT(seen[0], 50);
    EXPECT_GT(seen[1], 50);
}

TEST(Spheres, StagingGivesTheSame) {
    const test::FunctionDatabase database(kGrid, 3, test::random_sample);
    const SphereOptions options = {.size = 33, .field_of_view = 60, .lights = {{1, 2, 3}}};
    const auto mapped = render(test::lavapipe(), database, {0, 1, 2}, options);
    const auto staged = render(test::lavapipe_with_staging(), database, {0, 1, 2}, options);
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(mapped[i].pixels, staged[i].pixels);
    }
}

TEST(Spheres, NegativeIsBlackAndNothingIsNotANumber) {
    // The largest reflectance there may be beside samples that were not measured; a light from
    // behind, one along the view and one that grazes.
    const test::FunctionDatabase database(
        kGrid, 2, [](std::size_t material, std::uint64_t voxel, std::size_t) {
            return material == 0 ? -1 : voxel % 2 == 0 ? kMaxReflectance : -1e9;
        });
    const SphereOptions options = {.size = 64,
                                   .field_of_view = 60,
                                   .lights = {{0, 0, 1}, {0, 0, -1}, {1, 0, 0}, {0, 0, 1e-5}}};
    for (const auto& image : render(test::lavapipe(), database, {0, 1}, options)) {
        for (const auto& pixel : image.pixels) {
            for (std::size_t c = 0; c < 3; ++c) {
                ASSERT_TRUE(std::isfinite(pixel[c]) && pixel[c] >= 0);
                ASSERT_TRUE(image.material == 1 || pixel[c] == 0);
            }
        }
    }
}

TEST(Spheres, SayWhatTheyShow) {
    const test::FunctionDatabase database(kGrid, 3, test::random_sample);
    const Domain domain(kGrid);
    const VoxelList voxels(domain, VoxelSet::above_horizon);
    SlabReader reader(database, voxels);
    reader.read(Slab(domain, voxels, 0, voxels.size()), [](std::size_t, auto, auto) {});
    const auto hashes = reader.material_hashes();
    const std::vector<std::size_t> materials = {2, 0, 1};
    render_spheres(test::lavapipe(), database, materials,
                   {.size = 16, .field_of_view = 60, .lights = {{1, 1, 1}, {-1, 1, 1}}},
                   [&](const SphereImage& image) {
                       EXPECT_EQ(image.content_hash, hashes[materials[image.material]]);
                   });
    EXPECT_NE(hashes[0], hashes[1]);
    EXPECT_EQ(content_hash_of(database, [](double) {}),
              content_digest(database.materials(), database.grid().text(), reader.plane_hashes()));
}

TEST(Spheres, NoMaterialIsNoImage) {
    EXPECT_TRUE(render(test::lavapipe(), lambertian(), {}, {}).empty());
}

TEST(Spheres, WhatTheSinkThrowsComesOut) {
    EXPECT_THROW(render_spheres(test::lavapipe(), lambertian(), std::vector<std::size_t>{0, 1, 2},
                                {.size = 32, .field_of_view = 60, .lights = {{1, 1, 1}}},
                                [](const SphereImage&) { throw std::runtime_error("stop"); }),
                 std::runtime_error);
}

TEST(Spheres, WhatIsThrownWhileTheDeviceWorksComesOut) {
    const auto context = test::other_device("kind=discrete hang-at=1");
    EXPECT_THROW(render_spheres(
                     *context, lambertian(), std::vector<std::size_t>{0},
                     {.size = 32, .field_of_view = 60, .lights = {{1, 1, 1}}},
                     [](const SphereImage&) {}, [] { throw std::runtime_error("stop"); }),
                 std::runtime_error);
}

}  // namespace
}  // namespace merl::engine
