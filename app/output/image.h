#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace merl::app {

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

/// A file of 32-bit float OpenEXR, channels R, G and B, the values as they are, with a comment
/// (UTF-8) unless that is empty.
std::string exr_file(const Image& image, const std::string& comment = {});

/// A file of 8-bit PNG, of values that are already encoded for display, clamped to [0, 1], with a
/// comment (UTF-8) unless that is empty.
std::string png_file(const Image& image, const std::string& comment = {});

/// The comment of a PNG file, as png_file() writes it; empty if it has none.
std::string png_comment(std::string_view file);

/// The sRGB encoding (IEC 61966-2-1) of linear light in [0, 1]; beyond it is clamped.
float srgb(float linear);

/// The sRGB encoding of a grey whose CIE lightness L* is 100·value: equal steps look equal.
float lightness(float value);

}  // namespace merl::app
