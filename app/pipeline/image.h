#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace merl::pipeline {

/// A float RGB image, rows from the top.
struct Image {
    Image(std::uint32_t width_, std::uint32_t height_)
        : width(width_), height(height_), pixels(std::size_t{width_} * height_) {}

    std::uint32_t width;
    std::uint32_t height;
    std::vector<std::array<float, 3>> pixels;

    std::array<float, 3>& at(std::uint32_t x, std::uint32_t y) {
        return pixels[std::size_t{y} * width + x];
    }
    const std::array<float, 3>& at(std::uint32_t x, std::uint32_t y) const {
        return pixels[std::size_t{y} * width + x];
    }
};

/// The sRGB encoding (IEC 61966-2-1) of linear light in [0, 1]; beyond it is clamped.
float srgb(float linear);

/// The sRGB encoding of a grey whose CIE lightness L* is 100·value: equal steps look equal.
float lightness(float value);

}  // namespace merl::pipeline
