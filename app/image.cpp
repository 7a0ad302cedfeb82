#include "app/image.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <fmt/format.h>
#include <png.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "engine/error.h"

namespace merl::app {

void write_exr(const std::filesystem::path& path, const Image& image) {
    try {
        Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
        Imf::FrameBuffer frame;
        constexpr std::size_t kPixel = sizeof(image.pixels[0]);
        const char* const names[] = {"R", "G", "B"};
        for (std::size_t channel = 0; channel < 3; ++channel) {
            header.channels().insert(names[channel], Imf::Channel(Imf::FLOAT));
            const auto* first = reinterpret_cast<const char*>(&image.pixels[0][channel]);
            frame.insert(names[channel], Imf::Slice(Imf::FLOAT, const_cast<char*>(first), kPixel,
                                                    kPixel * image.width));
        }
        Imf::OutputFile file(path.c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(static_cast<int>(image.height));
    } catch (const std::exception& error) {
        throw Error(Fault::output,
                    fmt::format("{}: cannot be written: {}", path.string(), error.what()));
    }
}

void write_png(const std::filesystem::path& path, const Image& image) {
    std::vector<std::array<png_byte, 3>> bytes(image.pixels.size());
    std::transform(image.pixels.begin(), image.pixels.end(), bytes.begin(), [](const auto& pixel) {
        std::array<png_byte, 3> to = {};
        std::transform(pixel.begin(), pixel.end(), to.begin(), [](float value) {
            return static_cast<png_byte>(std::lround(255 * std::clamp(value, 0.0F, 1.0F)));
        });
        return to;
    });
    png_image png = {};
    png.version = PNG_IMAGE_VERSION;
    png.width = image.width;
    png.height = image.height;
    png.format = PNG_FORMAT_RGB;
    if (png_image_write_to_file(&png, path.c_str(), 0, bytes.data(), 0, nullptr) == 0) {
        throw Error(Fault::output,
                    fmt::format("{}: cannot be written: {}", path.string(), png.message));
    }
}

float srgb(float linear) {
    const float x = std::clamp(linear, 0.0F, 1.0F);
    return x <= 0.0031308F ? 12.92F * x : 1.055F * std::pow(x, 1 / 2.4F) - 0.055F;
}

float lightness(float value) {
    const float l = 100 * std::clamp(value, 0.0F, 1.0F);
    const float f = (l + 16) / 116;
    return srgb(l > 8 ? f * f * f : l * 27.0F / 24389.0F);
}

}  // namespace merl::app
