#pragma once

#include <CLI/CLI.hpp>
#include <cstddef>
#include <functional>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <vector>

#include "app/output/image.h"
#include "engine/database/database.h"
#include "engine/render/spheres.h"

namespace merl::app {

/// What the commands that show spheres let the user choose.
struct SphereImageOptions {
    std::uint32_t size = 512;
    double field_of_view = 60;
    std::vector<std::string> lights = {"1,1,1"};
    double exposure = 0;      // in stops
    double background = 0.5;  // grey as displayed, from 0 to 1
    std::string encoding = "gamma";
    std::string device;
};

/// Adds --size, --fov, --light, --exposure, --background, --encoding and --device.
void add_sphere_options(CLI::App& command, SphereImageOptions& options);

/// The options for summaries.
nlohmann::ordered_json sphere_options_json(const SphereImageOptions& options);

/// Encodes linear light for display: gamma 1/2.2 as in the thesis, or sRGB; clamps to [0, 1].
Image displayed(const Image& linear, const SphereImageOptions& options);

/// Called with each image when it is done: what it shows, and linear light, exposed and before the
/// background.
using SphereImageSink = std::function<void(const engine::SphereImage& sphere, const Image& linear)>;

/// A comment on an image that also says what was rendered.
std::string with_content_hash(const std::string& comment, const std::string& content_hash);

/// The content hash that a comment says; empty if it says none.
std::string content_hash_in(const std::string& comment);

/// Opens the device and renders the materials. `progress` is called with the share that is done.
/// Returns the device's name. Throws Error (usage for a light that is no direction).
std::string render_sphere_images(const engine::Database& database,
                                 std::span<const std::size_t> materials,
                                 const SphereImageOptions& options, const SphereImageSink& sink,
                                 const std::function<void(double share)>& progress);

}  // namespace merl::app
