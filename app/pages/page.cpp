#include "app/pages/page.h"

#include <fmt/format.h>

#include <cstdint>
#include <stdexcept>
#include <utility>

#include "engine/base/text.h"

namespace merl::app {
namespace {

/// What pages show as \xNN: the hidden characters but for tabs and line ends, which are nothing in
/// a page, as they stand in the brackets of a regular expression of JavaScript with the flag u.
std::string hidden_in_pages() {
    std::string text;
    for (const auto [first, last] : hidden_characters()) {
        if (first != U'\t' && first != U'\r') {
            text += fmt::format("\\u{{{:x}}}-\\u{{{:x}}}", static_cast<std::uint32_t>(first),
                                static_cast<std::uint32_t>(last));
        }
    }
    return text;
}

}  // namespace

std::string markup_text(std::string_view text) {
    std::string result;
    for (const char c : text) {
        switch (c) {
            case '&':
                result += "&amp;";
                break;
            case '<':
                result += "&lt;";
                break;
            case '>':
                result += "&gt;";
                break;
            case '"':
                result += "&quot;";
                break;
            default:
                result += c;
        }
    }
    return result;
}

std::string script_json(const nlohmann::ordered_json& json) {
    std::string text;
    for (const char c :
         json.dump(-1, ' ', true, nlohmann::ordered_json::error_handler_t::replace)) {
        // These occur inside strings only.
        if (c == '<' || c == '>' || c == '&') {
            text += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        } else {
            text += c;
        }
    }
    return text;
}

std::string base64(std::string_view bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::string_view three = bytes.substr(i, 3);
        std::uint32_t bits = 0;
        for (std::size_t j = 0; j < 3; ++j) {
            bits = bits << 8U | (j < three.size() ? static_cast<unsigned char>(three[j]) : 0U);
        }
        for (std::size_t j = 0; j < 4; ++j) {
            text += j <= three.size() ? kDigits[bits >> (18 - 6 * j) & 63U] : '=';
        }
    }
    return text;
}

std::string filled_in(std::string page, std::string_view place, const std::string& text) {
    const auto at = page.find(place);
    if (at == std::string::npos) {
        throw std::logic_error(fmt::format("the page has no place for its {}", place));
    }
    return page.replace(at, place.size(), text);
}

std::string page_of(std::string page, const nlohmann::ordered_json& data) {
    page = filled_in(std::move(page), "%HIDDEN%", hidden_in_pages());
    return filled_in(std::move(page), "%DATA%", script_json(data));
}

}  // namespace merl::app
