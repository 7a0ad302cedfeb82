#pragma once

#include <span>
#include <string>
#include <string_view>

namespace merl {

/// The text with every byte that is not UTF-8 as \xNN. A backslash before an x becomes \x5c, so
/// that different texts stay different.
std::string as_utf8(std::string_view text);

/// The text that as_utf8 made this of.
std::string from_utf8(std::string_view text);

/// as_utf8 with hidden characters as \xNN too: on one line, harmless to a terminal, and what looks
/// the same is the same.
std::string printable(std::string_view text);

/// The text without the byte order mark that some programs put before UTF-8.
std::string_view without_byte_order_mark(std::string_view text);

/// The text without the blanks at both ends.
std::string_view trimmed(std::string_view text);

/// Code points from the first to the last.
struct CharacterRange {
    char32_t first, last;
};

/// Control characters, and those that are not seen but change how others are (the order of writing,
/// joining, nothing at all).
std::span<const CharacterRange> hidden_characters();

}  // namespace merl
