#include "app/output/image_file.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStdIO.h>
#include <fmt/format.h>
#include <png.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace merl::app {

namespace {

void append_big_endian(std::string& out, unsigned long value) {
    for (int shift = 24; shift >= 0; shift -= 8) {
        out += static_cast<char>(value >> shift & 0xffU);
    }
}

/// What a PNG chunk of text begins with: its kind, the keyword Comment, not compressed, in no
/// language.
constexpr std::string_view kComment("iTXtComment\0\0\0\0\0", 16);

/// What comes before a content hash in a comment.
constexpr std::string_view kContent = "; content ";

constexpr std::size_t kSignature = 8;  // bytes at the beginning of a PNG file

/// A chunk of a comment.
std::string text_chunk(const std::string& text) {
    const std::string content = std::string(kComment) + text;
    std::string chunk;
    append_big_endian(chunk, content.size() - 4);
    chunk += content;
    append_big_endian(chunk, ::crc32_z(0, reinterpret_cast<const Bytef*>(content.data()),  //
                                       content.size()));
    return chunk;
}

}  // namespace

std::string exr_file(const pipeline::Image& image, const std::string& comment) {
    Imf::Header header(static_cast<int>(image.width), static_cast<int>(image.height));
    if (!comment.empty()) {
        Imf::addComments(header, comment);
    }
    Imf::FrameBuffer frame;
    constexpr std::size_t kPixel = sizeof(image.pixels[0]);
    const char* const names[] = {"R", "G", "B"};
    for (std::size_t channel = 0; channel < 3; ++channel) {
        header.channels().insert(names[channel], Imf::Channel(Imf::FLOAT));
        const auto* first = reinterpret_cast<const char*>(&image.pixels[0][channel]);
        frame.insert(names[channel], Imf::Slice(Imf::FLOAT, const_cast<char*>(first), kPixel,
                                                kPixel * image.width));
    }
    Imf::StdOSStream stream;
    {
        Imf::OutputFile file(stream, header);
        file.setFrameBuffer(frame);
        file.writePixels(static_cast<int>(image.height));
    }  // writes the table of lines
    return stream.str();
}

std::string png_file(const pipeline::Image& image, const std::string& comment) {
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
    png_alloc_size_t size = PNG_IMAGE_PNG_SIZE_MAX(png);
    std::string file(size, '\0');
    if (png_image_write_to_memory(&png, file.data(), &size, 0, bytes.data(), 0, nullptr) == 0) {
        throw std::runtime_error(fmt::format("libpng: {}", png.message));
    }
    file.resize(size);
    constexpr std::size_t kSignatureAndHeader = kSignature + 25;
    return comment.empty() ? file : file.insert(kSignatureAndHeader, text_chunk(comment));
}

std::string png_comment(std::string_view file) {
    constexpr std::size_t kAround = 12;  // the length, the kind and the checksum of a chunk
    for (std::size_t at = kSignature; at + kAround <= file.size();) {
        std::size_t length = 0;
        for (std::size_t i = 0; i < 4; ++i) {
            length = length << 8U | static_cast<unsigned char>(file[at + i]);
        }
        if (length > file.size() - at - kAround) {
            break;
        }
        const auto chunk = file.substr(at + 4, 4 + length);
        if (chunk.starts_with(kComment)) {
            return std::string(chunk.substr(kComment.size()));
        }
        at += kAround + length;
    }
    return "";
}

std::string with_content_hash(const std::string& comment, const std::string& content_hash) {
    return comment + std::string(kContent) + content_hash;
}

std::string content_hash_in(const std::string& comment) {
    const auto at = comment.rfind(kContent);
    return at == std::string::npos ? "" : comment.substr(at + kContent.size());
}

}  // namespace merl::app
