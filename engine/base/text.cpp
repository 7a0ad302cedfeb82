#include "engine/base/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstddef>

namespace merl {
namespace {

/// Bytes of the UTF-8 character (RFC 3629) that the text begins with; 0 if it begins with none.
std::size_t character_length(std::string_view text) {
    const auto byte = [&](std::size_t i) {
        return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U;
    };
    const unsigned first = byte(0);
    if (first < 0x80) {
        return 1;
    }
    if (first < 0xc2 || first > 0xf4) {
        return 0;
    }
    // Neither a longer form than needed, nor a surrogate, nor beyond U+10FFFF.
    const unsigned least = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
    const unsigned most = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
    if (byte(1) < least || byte(1) > most) {
        return 0;
    }
    const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
    for (std::size_t i = 2; i < length; ++i) {
        if (byte(i) < 0x80 || byte(i) > 0xbf) {
            return 0;
        }
    }
    return length;
}

/// The number of a character that is UTF-8.
char32_t code_point(std::string_view character) {
    constexpr std::array<unsigned, 5> kFirst = {0, 0x7f, 0x1f, 0x0f, 0x07};  // bits, by length
    char32_t code = static_cast<unsigned char>(character[0]) & kFirst.at(character.size());
    for (const char byte : character.substr(1)) {
        code = code << 6U | (static_cast<unsigned char>(byte) & 0x3fU);
    }
    return code;
}

/// Control characters (C0, delete, C1) and what is not seen: format characters (Unicode's Cf, but
/// for those that are signs of their own), separators of lines, fillers and what nobody has
/// assigned among the tags.
constexpr std::array<CharacterRange, 21> kHidden = {
    {{0x00, 0x08},       {0x09, 0x0a},  // tab and line feed
     {0x0b, 0x0c},       {0x0d, 0x0d},  // carriage return
     {0x0e, 0x1f},       {0x7f, 0x9f},      {0xad, 0xad},     {0x34f, 0x34f},   {0x61c, 0x61c},
     {0x115f, 0x1160},   {0x17b4, 0x17b5},  {0x180b, 0x180f}, {0x200b, 0x200f}, {0x2028, 0x202e},
     {0x2060, 0x206f},   {0x3164, 0x3164},  {0xfeff, 0xfeff}, {0xffa0, 0xffa0}, {0xfff0, 0xfffb},
     {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff}}};

bool is_hidden(char32_t c) {
    return std::ranges::any_of(kHidden,
                               [=](CharacterRange r) { return r.first <= c && c <= r.last; });
}

std::string escaped(std::string_view text, bool controls) {
    std::string result;
    while (!text.empty()) {
        const std::size_t length = character_length(text);
        const std::string_view character = text.substr(0, std::max<std::size_t>(length, 1));
        if (length == 0 || text.starts_with("\\x") ||
            (controls && is_hidden(code_point(character)))) {
            for (const char byte : character) {
                result += fmt::format("\\x{:02x}", static_cast<unsigned char>(byte));
            }
        } else {
            result += character;
        }
        text.remove_prefix(character.size());
    }
    return result;
}

}  // namespace

std::string as_utf8(std::string_view text) {
    return escaped(text, false);
}

std::string from_utf8(std::string_view text) {
    std::string result;
    while (!text.empty()) {
        unsigned byte = 0;
        if (text.starts_with("\\x") && text.size() >= 4 &&
            std::from_chars(text.data() + 2, text.data() + 4, byte, 16).ptr == text.data() + 4) {
            result += static_cast<char>(byte);
            text.remove_prefix(4);
        } else {
            result += text.front();
            text.remove_prefix(1);
        }
    }
    return result;
}

std::string printable(std::string_view text) {
    return escaped(text, true);
}

std::span<const CharacterRange> hidden_characters() {
    return kHidden;
}

std::string_view without_byte_order_mark(std::string_view text) {
    constexpr std::string_view mark = "\xef\xbb\xbf";
    return text.starts_with(mark) ? text.substr(mark.size()) : text;
}

std::string_view trimmed(std::string_view text) {
    const auto first = text.find_first_not_of(" \t\r");
    return first == std::string_view::npos
               ? std::string_view()
               : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

}  // namespace merl
