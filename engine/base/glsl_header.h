#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace merl {

/// One "// key: value" of a GLSL file.
struct HeaderLine {
    std::string_view key;
    std::string_view value;  // on the line itself
    std::string text;        // with the lines that continue it, one blank between them
    std::uint64_t number = 0;
};

/// The comment lines at the top of a GLSL file that say what it is.
struct GlslHeader {
    /// A line of another form is a comment; one that begins with two more blanks continues a value.
    std::vector<HeaderLine> lines;
    std::uint64_t last_line = 0;  // of the comment
};

/// Reads them; views are into `text`.
GlslHeader read_glsl_header(std::string_view text);

/// Whether a text is a lower-case letter, then lower-case letters, digits and _, at most
/// longest_header_name in all: a key, or what a header may name.
bool is_header_name(std::string_view text);

inline constexpr std::size_t longest_header_name = 32;

}  // namespace merl
