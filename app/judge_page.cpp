#include "app/judge_page.h"

#include <cstdint>
#include <string_view>

#include "app/judge_page_html.h"
#include "app/page.h"

namespace merl::app {
namespace {

/// RFC 4648, section 4.
void append_base64(std::string& out, std::string_view bytes) {
    constexpr std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::string_view three = bytes.substr(i, 3);
        std::uint32_t bits = 0;
        for (std::size_t j = 0; j < 3; ++j) {
            bits = bits << 8U | (j < three.size() ? static_cast<unsigned char>(three[j]) : 0U);
        }
        for (std::size_t j = 0; j < 4; ++j) {
            out += j <= three.size() ? kDigits[bits >> (18 - 6 * j) & 63U] : '=';
        }
    }
}

}  // namespace

std::string judge_page(const nlohmann::ordered_json& data,
                       const std::vector<std::vector<std::string>>& images) {
    std::string list = "[";
    for (const auto& lights : images) {
        list += list.size() > 1 ? ",\n[" : "[";
        for (const auto& file : lights) {
            list += list.back() == '"' ? ",\"" : "\"";
            append_base64(list, file);
            list += '"';
        }
        list += ']';
    }
    // The images first: nothing in base64 looks like the other place.
    const auto page = filled_in(kJudgePage, "%IMAGES%", list + "]");
    return filled_in(page, "%DATA%", script_json(data));
}

}  // namespace merl::app
