#pragma once

#include <string>
#include <string_view>

#include "app/pipeline/image.h"

namespace merl::app {

/// A file of 32-bit float OpenEXR, channels R, G and B, the values as they are, with a comment
/// (UTF-8) unless that is empty.
std::string exr_file(const pipeline::Image& image, const std::string& comment = {});

/// A file of 8-bit PNG, of values that are already encoded for display, clamped to [0, 1], with a
/// comment (UTF-8) unless that is empty.
std::string png_file(const pipeline::Image& image, const std::string& comment = {});

/// The comment of a PNG file, as png_file() writes it; empty if it has none.
std::string png_comment(std::string_view file);

/// A comment on an image that also says what was rendered.
std::string with_content_hash(const std::string& comment, const std::string& content_hash);

/// The content hash that a comment says; empty if it says none.
std::string content_hash_in(const std::string& comment);

}  // namespace merl::app
