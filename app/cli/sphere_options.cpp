#include "app/cli/sphere_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "app/cli/options.h"
#include "engine/base/error.h"

namespace merl::app {
namespace {

/// "x,y,z" as a direction that is not 0.
std::array<double, 3> parse_light(const std::string& text) {
    std::array<double, 3> light = {};
    const char* at = text.data();
    const char* const end = at + text.size();
    bool good = true;
    for (std::size_t i = 0; i < light.size() && good; ++i) {
        if (i > 0) {
            good = at != end && *at++ == ',';
        }
        const auto [stop, error] = std::from_chars(at, end, light[i]);
        good = good && error == std::errc() && std::abs(light[i]) <= 1e6;  // and no NaN
        at = stop;
    }
    const double length = std::hypot(light[0], light[1], light[2]);
    if (!good || at != end || !(length >= 1e-6)) {
        throw Error(Fault::usage,
                    fmt::format("--light: expected a direction towards the light like 1,1,1, each "
                                "number from -1000000 to 1000000 and not all 0, found \"{}\"",
                                text));
    }
    return light;
}

}  // namespace

pipeline::SphereView SphereImageOptions::complete_view() const {
    auto complete = view;
    complete.sphere.lights.clear();
    std::ranges::transform(lights, std::back_inserter(complete.sphere.lights), parse_light);
    complete.encoding = encoding == "gamma" ? pipeline::Encoding::gamma : pipeline::Encoding::srgb;
    return complete;
}

void add_sphere_options(CLI::App& command, SphereImageOptions& options) {
    command
        .add_option("--size", options.view.sphere.size, "Width and height of an image, in pixels")
        ->transform(whole_number(16, 4096))
        ->capture_default_str();
    command
        .add_option("--fov", options.view.sphere.field_of_view,
                    "Field of view of the camera, in degrees")
        ->transform(number(1, 170))
        ->capture_default_str();
    command
        .add_option("--light", options.lights,
                    "Direction towards a light, x to the right, y up, z to the camera; the option "
                    "more than once gives an image for each")
        ->capture_default_str()
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    command.add_option("--exposure", options.view.exposure, "Exposure in stops: doubles with each")
        ->transform(number(-30, 30))
        ->capture_default_str();
    command
        .add_option("--background", options.view.background,
                    "Grey around the sphere as displayed, from 0 (black) to 1 (white)")
        ->transform(number(0, 1))
        ->capture_default_str();
    command
        .add_option("--encoding", options.encoding,
                    "How PNG encodes light: gamma (1/2.2, as in the thesis) or srgb")
        ->check(CLI::IsMember({"gamma", "srgb"}))
        ->capture_default_str();
    command.add_option("--device", options.device,
                       "A Vulkan device by number or part of its name (default: the best)");
}

}  // namespace merl::app
