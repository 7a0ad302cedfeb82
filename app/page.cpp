#include "app/page.h"

#include <fmt/format.h>

#include <stdexcept>

namespace merl::app {

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

std::string filled_in(std::string page, std::string_view place, const std::string& text) {
    const auto at = page.find(place);
    if (at == std::string::npos) {
        throw std::logic_error(fmt::format("the page has no place for its {}", place));
    }
    return page.replace(at, place.size(), text);
}

}  // namespace merl::app
