#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "app/pipeline/spheres.h"

namespace merl::app {

/// What the commands that show spheres let the user choose.
struct SphereImageOptions {
    pipeline::SphereView view = {};               // but for lights and encoding, which are below
    std::vector<std::string> lights = {"1,1,1"};  // as they were given
    std::string encoding = "gamma";
    std::string device = {};

    /// All of it. Throws Error (usage) for a light that is no direction.
    pipeline::SphereView complete_view() const;
};

/// Adds --size, --fov, --light, --exposure, --background, --encoding and --device.
void add_sphere_options(CLI::App& command, SphereImageOptions& options);

}  // namespace merl::app
