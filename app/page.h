#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace merl::app {

/// A page of results: an HTML template with %DATA% in a script element, where `data` is put.
/// Nothing in the data can end the element, whatever texts it has.
std::string fill_page(std::string page, const nlohmann::ordered_json& data);

}  // namespace merl::app
