#include "app/cli/completion.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <functional>
#include <string_view>
#include <vector>

#include "app/cli/declared.h"

namespace merl::app {
namespace {

/// Commands above one, without the program: "database info".
std::string path_of(const CLI::App& command) {
    const auto name = full_name(command);
    const auto space = name.find(' ');
    return space == std::string::npos ? "" : name.substr(space + 1);
}

/// Calls `use` with the program and every command, those above before those below.
void walk(const CLI::App& command, const std::function<void(const CLI::App&)>& use) {
    use(command);
    for (const auto* one : declared_commands(command)) {
        walk(*one, use);
    }
}

/// The first line, without what quotes and brackets mean to shells.
std::string plain(std::string_view text) {
    std::string result(text.substr(0, text.find('\n')));
    std::erase_if(result, [](char c) {
        return std::string_view("'\"\\[]`$").find(c) != std::string_view::npos;
    });
    return result;
}

/// The same with colons escaped, which separate fields in zsh.
std::string zsh_text(std::string_view text) {
    std::string result;
    for (const char c : plain(text)) {
        result += c == ':' ? "\\:" : std::string(1, c);
    }
    return result;
}

std::string zsh_function(const CLI::App& command) {
    std::string name = full_name(command);
    std::ranges::replace(name, ' ', '_');
    std::ranges::replace(name, '-', '_');
    return "_" + name;
}

}  // namespace

std::string bash_completion(const CLI::App& program) {
    std::string paths;
    std::string words;
    std::string values;
    walk(program, [&](const CLI::App& command) {
        std::vector<std::string> all;
        for (const auto* one : declared_commands(command)) {
            all.push_back(one->get_name());
            const auto above = path_of(command);
            paths += fmt::format("        \"{} {}\") command=\"{}\" ;;\n", above, one->get_name(),
                                 path_of(*one));
        }
        for (const auto* option : declared_options(command)) {
            for (const auto& name : spellings(*option)) {
                all.push_back(name);
                if (takes_value(*option)) {
                    values += fmt::format("{}\"{} {}\"", values.empty() ? "" : " | ",
                                          path_of(command), name);
                }
            }
        }
        words +=
            fmt::format("    \"{}\") words=\"{}\" ;;\n", path_of(command), fmt::join(all, " "));
    });
    return fmt::format(
        "# Completes merl-scan in bash.\n"
        "_merl_scan() {{\n"
        "    local command=\"\" words=\"\" i\n"
        "    for ((i = 1; i < COMP_CWORD; ++i)); do\n"
        "        case \"$command ${{COMP_WORDS[i]}}\" in\n"
        "{}"
        "        esac\n"
        "    done\n"
        "    COMPREPLY=()\n"
        "    case \"$command ${{COMP_WORDS[COMP_CWORD - 1]}}\" in\n"
        "    {}) return ;;\n"
        "    esac\n"
        "    case \"$command\" in\n"
        "{}"
        "    esac\n"
        "    COMPREPLY=($(compgen -W \"$words\" -- \"${{COMP_WORDS[COMP_CWORD]}}\"))\n"
        "}}\n"
        "complete -o bashdefault -o default -F _merl_scan merl-scan\n",
        paths, values, words);
}

std::string zsh_completion(const CLI::App& program) {
    std::string text = "#compdef merl-scan\n# Completes merl-scan in zsh.\n";
    walk(program, [&](const CLI::App& command) {
        std::string lines;
        for (const auto* option : declared_options(command)) {
            for (const auto& name : spellings(*option)) {
                lines += fmt::format(" \\\n        '*{}[{}]{}'", name,
                                     zsh_text(option->get_description()),
                                     takes_value(*option) ? ":value:_files" : "");
            }
        }
        const auto commands = declared_commands(command);
        if (commands.empty()) {
            text += fmt::format("{}() {{\n    _arguments{} \\\n        '*:file:_files'\n}}\n",
                                zsh_function(command), lines);
            return;
        }
        std::string described;
        std::string calls;
        for (const auto* one : commands) {
            described +=
                fmt::format(" \\\n                '{}:{}'", one->get_name(), zsh_text(title(*one)));
            calls += fmt::format("            {}) {} ;;\n", one->get_name(), zsh_function(*one));
        }
        text += fmt::format(
            "{}() {{\n"
            "    local context state state_descr line\n"
            "    typeset -A opt_args\n"
            "    _arguments -C{} \\\n"
            "        '1:command:->command' \\\n"
            "        '*::argument:->argument'\n"
            "    case $state in\n"
            "        command)\n"
            "            local -a commands=({})\n"
            "            _describe command commands ;;\n"
            "        argument)\n"
            "            case $line[1] in\n"
            "{}"
            "            esac ;;\n"
            "    esac\n"
            "}}\n",
            zsh_function(command), lines, described, calls);
    });
    return text +
           "if [ \"$funcstack[1]\" = _merl-scan ]; then\n    _merl_scan \"$@\"\n"
           "else\n    compdef _merl_scan merl-scan\nfi\n";
}

std::string fish_completion(const CLI::App& program) {
    std::string text = "# Completes merl-scan in fish.\n";
    walk(program, [&](const CLI::App& command) {
        std::string condition = "__fish_use_subcommand";
        if (command.get_parent() != nullptr) {
            condition.clear();
            for (const auto* one = &command; one->get_parent() != nullptr;
                 one = one->get_parent()) {
                condition = fmt::format("__fish_seen_subcommand_from {}{}{}", one->get_name(),
                                        condition.empty() ? "" : "; and ", condition);
            }
        }
        for (const auto* one : declared_commands(command)) {
            text += fmt::format("complete -c merl-scan -n '{}' -a {} -d '{}'\n", condition,
                                one->get_name(), plain(title(*one)));
        }
        for (const auto* option : declared_options(command)) {
            text += fmt::format("complete -c merl-scan -n '{}'", condition);
            for (const auto& name : option->get_snames()) {
                text += " -s " + name;
            }
            for (const auto& name : option->get_lnames()) {
                text += " -l " + name;
            }
            text += fmt::format("{} -d '{}'\n", takes_value(*option) ? " -r" : "",
                                plain(option->get_description()));
        }
    });
    return text;
}

}  // namespace merl::app
