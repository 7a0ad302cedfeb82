#include "app/pipeline/spheres.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "engine/base/error.h"

namespace merl::pipeline {
namespace {

constexpr double kGamma = 2.2;  // Ryman 2018, section 5.3

/// Two materials are worked on at a time, and each has an image for every light.
void require_room(const SphereView& view) {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 30U;
    const std::uint64_t bytes = std::uint64_t{view.sphere.size} * view.sphere.size * 2 *
                                view.sphere.lights.size() * sizeof(engine::SpherePixel);
    if (bytes > kMost) {
        throw Error(
            Fault::usage,
            fmt::format(
                "images of {0} x {0} pixels under {1} lights take {2} MiB at a time; expected "
                "{3} or less",
                view.sphere.size, view.sphere.lights.size(), bytes >> 20U, kMost >> 20U));
    }
}

/// Linear light of a grey as displayed.
float linear_grey(double grey, Encoding encoding) {
    if (encoding == Encoding::gamma) {
        return static_cast<float>(std::pow(grey, kGamma));
    }
    return static_cast<float>(grey <= 0.04045 ? grey / 12.92
                                              : std::pow((grey + 0.055) / 1.055, 2.4));
}

/// The brightest channel of each pixel that the sphere covers wholly.
std::vector<float> brightest_channels(std::span<const engine::SpherePixel> pixels) {
    constexpr float kWhole = 0.999F;
    std::vector<float> brightest;
    for (const auto& p : pixels) {
        if (p[3] > kWhole) {
            brightest.push_back(std::max({p[0], p[1], p[2]}));
        }
    }
    return brightest;
}

}  // namespace

const char* encoding_name(Encoding encoding) {
    return encoding == Encoding::gamma ? "gamma" : "srgb";
}

Image exposed(std::span<const engine::SpherePixel> pixels, const SphereView& view) {
    Image image(view.sphere.size, view.sphere.size);
    const auto scale = static_cast<float>(std::exp2(view.exposure));
    const float grey = linear_grey(view.background, view.encoding);
    std::ranges::transform(pixels, image.pixels.begin(), [&](const auto& p) {
        const float behind = (1 - p[3]) * grey;
        return std::array{p[0] * scale + behind, p[1] * scale + behind, p[2] * scale + behind};
    });
    return image;
}

double clipped_share(std::span<const engine::SpherePixel> pixels, double exposure) {
    const auto brightest = brightest_channels(pixels);
    const auto white = static_cast<float>(std::exp2(-exposure));
    const auto clipped = std::ranges::count_if(brightest, [&](float x) { return x > white; });
    return brightest.empty() ? 0
                             : static_cast<double>(clipped) / static_cast<double>(brightest.size());
}

double exposure_by_image(std::span<const engine::SpherePixel> pixels) {
    constexpr std::size_t kClipped = 100;  // one of so many
    auto brightest = brightest_channels(pixels);
    if (brightest.empty()) {
        return 0;
    }
    const auto place = brightest.begin() + static_cast<std::ptrdiff_t>(brightest.size() / kClipped);
    std::ranges::nth_element(brightest, place, std::greater<>());
    return *place > 0 ? -std::log2(double{*place}) : 0;
}

Image displayed(const Image& linear, const SphereView& view) {
    Image image = linear;
    for (auto& pixel : image.pixels) {
        for (float& value : pixel) {
            value = view.encoding == Encoding::gamma
                        ? std::pow(std::clamp(value, 0.0F, 1.0F), static_cast<float>(1 / kGamma))
                        : srgb(value);
        }
    }
    return image;
}

device::DeviceInfo render_spheres(const engine::Database& database,
                                  std::span<const std::size_t> materials, const SphereView& view,
                                  const device::ContextOptions& device, const SphereImageSink& sink,
                                  const Control& control) {
    require_room(view);
    device::Context context(device);
    control.update("rendering", 0);
    const auto all = static_cast<double>(materials.size() * view.sphere.lights.size());
    double done = 0;
    engine::render_spheres(
        context, database, materials, view.sphere,
        [&](const engine::SphereImage& sphere) {
            sink(sphere, exposed(sphere.pixels, view));
            control.update("rendering", ++done / all);
        },
        [&] { control.update("rendering", done / all); });
    return context.info();
}

}  // namespace merl::pipeline
