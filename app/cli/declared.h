#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace merl::app {

// What the program declares, for everything that is made of it: help, man pages, completions.

/// The commands of a program or a command that users are told of, in order.
std::vector<const CLI::App*> declared_commands(const CLI::App& command);

/// Its options, without arguments by place, in order.
std::vector<const CLI::Option*> declared_options(const CLI::App& command);

/// Its arguments by place, in order.
std::vector<const CLI::Option*> declared_arguments(const CLI::App& command);

/// Whether a value has to follow the option.
bool takes_value(const CLI::Option& option);

/// "-V", "--version": the names of an option.
std::vector<std::string> spellings(const CLI::Option& option);

/// The command that these words name below a program; without a word the program. Throws Error
/// (usage) that names the word and what could be in its place.
const CLI::App& find_command(const CLI::App& program, const std::vector<std::string>& words);

/// "merl-scan database info".
std::string full_name(const CLI::App& command);

/// The first line of what a command says of itself.
std::string title(const CLI::App& command);

/// "[OPTIONS] name", what follows the name of a command.
std::string usage(const CLI::App& command);

/// Help that fits 100 columns and says of an option what it is, its default and whether it is
/// needed; which options exclude each other is an error's matter.
class HelpFormatter : public CLI::Formatter {
  public:
    std::string make_description(const CLI::App* command) const override;
    std::string make_footer(const CLI::App* command) const override;
    std::string make_option_opts(const CLI::Option* option) const override;
    std::string make_option(const CLI::Option* option, bool by_place) const override;
    std::string make_subcommand(const CLI::App* command) const override;
};

/// The help of a command, as --help prints it.
std::string help_of(const CLI::App& command);

}  // namespace merl::app
