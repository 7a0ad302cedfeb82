#include "app/page.h"

#include <fmt/format.h>

#include <stdexcept>
#include <string_view>

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// JSON that can stand in a script element: nothing in it begins or ends a tag or a comment.
std::string script_json(const ordered_json& json) {
    std::string text;
    for (const char c : json.dump(-1, ' ', true, ordered_json::error_handler_t::replace)) {
        // These occur inside strings only.
        if (c == '<' || c == '>' || c == '&') {
            text += fmt::format("\\u{:04x}", static_cast<unsigned>(c));
        } else {
            text += c;
        }
    }
    return text;
}

}  // namespace

std::string fill_page(std::string page, const ordered_json& data) {
    constexpr std::string_view kPlace = "%DATA%";
    const auto place = page.find(kPlace);
    if (place == std::string::npos) {
        throw std::logic_error("a page has no place for its data");
    }
    return page.replace(place, kPlace.size(), script_json(data));
}

}  // namespace merl::app
