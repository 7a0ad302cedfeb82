#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace merl::app {

// What completes the program's commands and options in a shell, made of what it declares. After an
// option with a value, and where no option is begun, files are completed.

std::string bash_completion(const CLI::App& program);
std::string zsh_completion(const CLI::App& program);
std::string fish_completion(const CLI::App& program);

}  // namespace merl::app
