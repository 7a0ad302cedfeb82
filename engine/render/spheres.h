#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/device/context.h"

namespace merl::engine {

/// How spheres are seen (Ryman 2018, 5.3; docs/experiment.md). The camera is on the +z axis, x to
/// the right and y up; wherever the field of view puts it, the sphere fills nine tenths of the
/// image's height.
struct SphereOptions {
    std::uint32_t size = 512;   // pixels in width and height
    double field_of_view = 60;  // degrees, of the whole image, more than 0 and less than 180
    /// Directions towards the lights, of any length but 0; each is white, of radiance·sr 1, and
    /// gives an image of its own.
    std::vector<std::array<double, 3>> lights = {{1, 1, 1}};
};

/// Linear radiance f·cos θ_i (red, green, blue) averaged over the pixel, zero off the sphere, and
/// the share of the pixel that the sphere covers.
using SpherePixel = std::array<float, 4>;

/// An image that is done.
struct SphereImage {
    std::size_t material;                 // its number in the list
    std::size_t light;                    // its number
    std::span<const SpherePixel> pixels;  // rows from the top
    /// Identifies the samples that were rendered: one of DistanceResult::material_hashes if they
    /// are those of a scan.
    std::string content_hash;
};

/// What it throws ends the rendering and comes out.
using SphereSink = std::function<void(const SphereImage&)>;

/// Renders a sphere of each of the materials (indices into the database's), in order, under each
/// light. Trilinear interpolation in the M-domain, repeating along M_r; reflectance below zero and
/// points below the horizon of light or eye are zero. While the device renders one material the
/// host reads the next; while the host waits it calls `meanwhile` as Submission::wait() does.
/// Throws Error (input) from the database, and (device) when a material does not fit into a buffer.
void render_spheres(device::Context& context, const Database& database,
                    std::span<const std::size_t> materials, const SphereOptions& options,
                    const SphereSink& sink, const std::function<void()>& meanwhile = {});

}  // namespace merl::engine
