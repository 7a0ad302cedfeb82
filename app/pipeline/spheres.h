#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>

#include "app/pipeline/control.h"
#include "app/pipeline/image.h"
#include "engine/database/database.h"
#include "engine/device/context.h"
#include "engine/render/spheres.h"

namespace merl::pipeline {

/// How light is encoded for display: gamma 1/2.2 as in Ryman 2018, or sRGB.
enum class Encoding { gamma, srgb };

/// "gamma" or "srgb".
const char* encoding_name(Encoding encoding);

/// How spheres are seen and shown.
struct SphereView {
    engine::SphereOptions sphere = {};
    double exposure = 0;      // in stops
    double background = 0.5;  // grey as displayed, from 0 to 1
    Encoding encoding = Encoding::gamma;
};

/// Encodes linear light for display; clamps to [0, 1].
Image displayed(const Image& linear, const SphereView& view);

/// Linear light as a view exposes it, before the background.
Image exposed(std::span<const engine::SpherePixel> pixels, const SphereView& view);

/// The share of the pixels that the sphere covers which so many stops make brighter than white in a
/// channel: PNG cuts that off.
double clipped_share(std::span<const engine::SpherePixel> pixels, double exposure);

/// The stops at which a hundredth of those pixels is clipped; 0 where all are black.
double exposure_by_image(std::span<const engine::SpherePixel> pixels);

/// Called with each image when it is done: what it shows, and linear light, exposed and before the
/// background.
using SphereImageSink = std::function<void(const engine::SphereImage& sphere, const Image& linear)>;

/// Renders the materials on the Vulkan device that a context opens, and says which. The stage is
/// "rendering". Throws Error: (usage) when the images are too many or too large, what opening a
/// device and engine::render_spheres() throw; and Cancelled.
device::DeviceInfo render_spheres(const engine::Database& database,
                                  std::span<const std::size_t> materials, const SphereView& view,
                                  const device::ContextOptions& device, const SphereImageSink& sink,
                                  const Control& control = {});

}  // namespace merl::pipeline
