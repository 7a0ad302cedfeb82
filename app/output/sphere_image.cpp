#include "app/output/sphere_image.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "app/cli/guard.h"
#include "app/cli/options.h"
#include "engine/base/error.h"
#include "engine/device/context.h"

namespace merl::app {
namespace {

constexpr double kGamma = 2.2;  // Ryman 2018, section 5.3
constexpr const char* kContent = "; content ";

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

/// Two materials are worked on at a time, and each has an image for every light.
void require_room(const SphereImageOptions& options) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 30U;
    const std::uint64_t bytes = std::uint64_t{options.size} * options.size * 2 *
                                options.lights.size() * sizeof(engine::SpherePixel);
    if (bytes > kMost) {
        throw Error(Fault::usage,
                    fmt::format("--size {} and {} lights make images of {} MiB at a time; expected "
                                "{} or less: choose a smaller --size or fewer lights",
                                options.size, options.lights.size(), bytes >> 20U, kMost >> 20U));
    }
}

/// Linear light of a grey as displayed.
float linear_grey(double grey, const std::string& encoding) {
    if (encoding == "gamma") {
        return static_cast<float>(std::pow(grey, kGamma));
    }
    return static_cast<float>(grey <= 0.04045 ? grey / 12.92
                                              : std::pow((grey + 0.055) / 1.055, 2.4));
}

Image compose(std::span<const engine::SpherePixel> pixels, const SphereImageOptions& options) {
    Image image(options.size, options.size);
    const auto scale = static_cast<float>(std::exp2(options.exposure));
    const float grey = linear_grey(options.background, options.encoding);
    std::ranges::transform(pixels, image.pixels.begin(), [&](const auto& p) {
        const float behind = (1 - p[3]) * grey;
        return std::array{p[0] * scale + behind, p[1] * scale + behind, p[2] * scale + behind};
    });
    return image;
}

}  // namespace

void add_sphere_options(CLI::App& command, SphereImageOptions& options) {
    command.add_option("--size", options.size, "Width and height of an image, in pixels")
        ->transform(whole_number(16, 4096))
        ->capture_default_str();
    command.add_option("--fov", options.field_of_view, "Field of view of the camera, in degrees")
        ->transform(number(1, 170))
        ->capture_default_str();
    command
        .add_option("--light", options.lights,
                    "Direction towards a light, x to the right, y up, z to the camera; the option "
                    "more than once gives an image for each")
        ->capture_default_str()
        ->expected(1)
        ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    command.add_option("--exposure", options.exposure, "Exposure in stops: doubles with each")
        ->transform(number(-30, 30))
        ->capture_default_str();
    command
        .add_option("--background", options.background,
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

nlohmann::ordered_json sphere_options_json(const SphereImageOptions& options) {
    nlohmann::ordered_json lights = nlohmann::ordered_json::array();
    for (const auto& light : options.lights) {
        lights.push_back(parse_light(light));
    }
    return {{"size", options.size},
            {"field_of_view", options.field_of_view},
            {"lights", lights},
            {"exposure", options.exposure},
            {"background", options.background},
            {"encoding", options.encoding}};
}

Image displayed(const Image& linear, const SphereImageOptions& options) {
    Image image = linear;
    const bool gamma = options.encoding == "gamma";
    for (auto& pixel : image.pixels) {
        for (float& value : pixel) {
            value = gamma ? std::pow(std::clamp(value, 0.0F, 1.0F), static_cast<float>(1 / kGamma))
                          : srgb(value);
        }
    }
    return image;
}

std::string with_content_hash(const std::string& comment, const std::string& content_hash) {
    return comment + kContent + content_hash;
}

std::string content_hash_in(const std::string& comment) {
    const auto at = comment.rfind(kContent);
    return at == std::string::npos ? "" : comment.substr(at + std::string_view(kContent).size());
}

std::string render_sphere_images(const engine::Database& database,
                                 std::span<const std::size_t> materials,
                                 const SphereImageOptions& options, const SphereImageSink& sink,
                                 const std::function<void(double share)>& progress) {
    engine::SphereOptions spheres = {
        .size = options.size, .field_of_view = options.field_of_view, .lights = {}};
    std::ranges::transform(options.lights, std::back_inserter(spheres.lights), parse_light);
    require_room(options);
    try_device_where_limited(options.device);
    device::Context context({.device = options.device});
    progress(0);
    const auto all = static_cast<double>(materials.size() * spheres.lights.size());
    double done = 0;
    engine::render_spheres(context, database, materials, spheres,
                           [&](const engine::SphereImage& sphere) {
                               sink(sphere, compose(sphere.pixels, options));
                               progress(++done / all);
                           });
    return fmt::format("{} ({}), {}", context.info().name, context.info().kind,
                       context.info().driver);
}

}  // namespace merl::app
