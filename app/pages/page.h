#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

namespace merl::app {

/// Text as it stands in HTML or XML, between tags and in double quotes.
std::string markup_text(std::string_view text);

/// JSON that can stand in a script element: nothing in it begins or ends a tag or a comment.
std::string script_json(const nlohmann::ordered_json& json);

/// RFC 4648, section 4.
std::string base64(std::string_view bytes);

/// A page that shows names and texts of users, with its two places filled in: %DATA% with the data
/// for its script, and %HIDDEN% with the characters that it has to make visible.
std::string page_of(std::string page, const nlohmann::ordered_json& data);

/// The page with `text` in the one place called `place`. Throws std::logic_error where it is
/// missing.
std::string filled_in(std::string page, std::string_view place, const std::string& text);

}  // namespace merl::app
