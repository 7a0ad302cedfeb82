#pragma once

#include <string>
#include <vector>

namespace merl::app {

/// An HTML page of the images NAME.png in its directory, each with its name, in their order.
std::string contact_page(const std::string& title, const std::vector<std::string>& names);

}  // namespace merl::app
