#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace merl::app {

/// The manual page of the program, or of one of its commands with those below it, for man(1), made
/// of what they declare.
std::string man_page(const CLI::App& command);

/// What the page is called: "merl-scan.1", "merl-scan-scan.1".
std::string man_page_name(const CLI::App& command);

}  // namespace merl::app
