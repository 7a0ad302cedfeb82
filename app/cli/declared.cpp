#include "app/cli/declared.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <string_view>

#include "engine/base/error.h"

namespace merl::app {
namespace {

constexpr std::size_t kColumns = 100;
constexpr std::size_t kText = 30;  // the column where texts begin, as CLI11 has it

/// Breaks the lines of a text at spaces so that none has more than `width` bytes.
std::vector<std::string> wrapped(std::string_view text, std::size_t width) {
    std::vector<std::string> lines;
    while (!text.empty()) {
        const auto end = std::min(text.find('\n'), text.size());
        std::string_view line = text.substr(0, end);
        text.remove_prefix(std::min(end + 1, text.size()));
        while (line.size() > width) {
            auto at = line.rfind(' ', width);
            if (at == std::string_view::npos || at == 0) {
                at = std::min(line.find(' '), line.size());
            }
            lines.emplace_back(line.substr(0, at));
            line.remove_prefix(std::min(at + 1, line.size()));
        }
        lines.emplace_back(line);
    }
    return lines;
}

/// A name and its text, which begins at a column of its own.
std::string entry(const std::string& name, const std::string& text) {
    std::string result = "  " + name;
    if (text.empty()) {
        return result + "\n";
    }
    const std::string margin(kText, ' ');
    result += result.size() < kText ? std::string(kText - result.size(), ' ') : "\n" + margin;
    return result + fmt::format("{}\n", fmt::join(wrapped(text, kColumns - kText), "\n" + margin));
}

}  // namespace

std::vector<const CLI::App*> declared_commands(const CLI::App& command) {
    return command.get_subcommands([](const CLI::App* one) { return !one->get_group().empty(); });
}

std::vector<const CLI::Option*> declared_options(const CLI::App& command) {
    return command.get_options(
        [](const CLI::Option* one) { return one->nonpositional() && !one->get_group().empty(); });
}

std::vector<const CLI::Option*> declared_arguments(const CLI::App& command) {
    return command.get_options([](const CLI::Option* one) { return one->get_positional(); });
}

bool takes_value(const CLI::Option& option) {
    return option.get_type_size() != 0;
}

std::vector<std::string> spellings(const CLI::Option& option) {
    std::vector<std::string> names;
    for (const auto& name : option.get_snames()) {
        names.push_back("-" + name);
    }
    for (const auto& name : option.get_lnames()) {
        names.push_back("--" + name);
    }
    return names;
}

const CLI::App& find_command(const CLI::App& program, const std::vector<std::string>& words) {
    const CLI::App* command = &program;
    for (const auto& word : words) {
        const auto commands = declared_commands(*command);
        const auto found = std::ranges::find(commands, word, &CLI::App::get_name);
        if (found == commands.end()) {
            std::vector<std::string> names(commands.size());
            std::ranges::transform(commands, names.begin(), &CLI::App::get_name);
            throw Error(
                Fault::usage,
                fmt::format("\"{}\" is no command of {}, which has {}", word, full_name(*command),
                            names.empty() ? "none" : fmt::format("{}", fmt::join(names, ", "))));
        }
        command = *found;
    }
    return *command;
}

std::string full_name(const CLI::App& command) {
    const auto* const parent = command.get_parent();
    return parent == nullptr ? command.get_name() : full_name(*parent) + " " + command.get_name();
}

std::string title(const CLI::App& command) {
    const std::string text = command.get_description();
    return text.substr(0, text.find('\n'));
}

std::string usage(const CLI::App& command) {
    std::string text = declared_options(command).empty() ? "" : " [OPTIONS]";
    for (const auto* argument : declared_arguments(command)) {
        const bool many = argument->get_expected_max() > 1;
        const std::string name = argument->get_name(true) + (many ? "..." : "");
        text += argument->get_required() ? " " + name : " [" + name + "]";
    }
    if (!declared_commands(command).empty()) {
        text += command.get_require_subcommand_min() == 0 ? " [COMMAND]" : " COMMAND";
    }
    return text.empty() ? text : text.substr(1);
}

std::string HelpFormatter::make_description(const CLI::App* command) const {
    return fmt::format(
        "{}\n", fmt::join(wrapped(CLI::Formatter::make_description(command), kColumns), "\n"));
}

std::string HelpFormatter::make_footer(const CLI::App* command) const {
    const auto text = command->get_footer();
    return text.empty() ? text : fmt::format("{}\n", fmt::join(wrapped(text, kColumns), "\n"));
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
    if (!takes_value(*option)) {
        return "";
    }
    std::string text = " " + option->get_type_name();
    if (!option->get_default_str().empty()) {
        text += "=" + option->get_default_str();
    }
    if (option->get_expected_max() > 1) {
        text += " ...";
    }
    return text + (option->get_required() ? " REQUIRED" : "");
}

std::string HelpFormatter::make_option(const CLI::Option* option, bool by_place) const {
    return entry(make_option_name(option, by_place) + make_option_opts(option),
                 make_option_desc(option));
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
    return entry(command->get_display_name(true), command->get_description());
}

std::string help_of(const CLI::App& command) {
    const auto* const parent = command.get_parent();
    // Not the command's help(), which is that of a command which was chosen below it.
    return command.get_formatter()->make_help(
        &command, parent == nullptr ? command.get_name() : full_name(command),
        CLI::AppFormatMode::Normal);
}

}  // namespace merl::app
