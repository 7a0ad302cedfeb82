#include "app/cli/man_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <string_view>

#include "app/cli/declared.h"
#include "app/pipeline/version.h"

namespace merl::app {
namespace {

/// A text as roff shows it: a hyphen that can be copied as a minus, no line that is a request.
std::string roff(std::string_view text) {
    std::string result;
    bool begins = true;
    for (const char c : text) {
        if (begins && (c == '.' || c == '\'')) {
            result += "\\&";
        }
        begins = c == '\n';
        switch (c) {
            case '\\':
                result += "\\e";
                break;
            case '-':
                result += "\\-";
                break;
            default:
                result += c;
        }
    }
    return result;
}

/// "merl-scan-scan".
std::string page_name(const CLI::App& command) {
    std::string name = full_name(command);
    std::ranges::replace(name, ' ', '-');
    return name;
}

std::string entries(const CLI::App& command) {
    std::string text;
    const auto add = [&](const std::string& names, const CLI::Option& option) {
        std::string value;
        if (takes_value(option)) {
            value = HelpFormatter().make_option_opts(&option);
        }
        text += fmt::format(".TP\n\\fB{}\\fR{}\n{}\n", roff(names), roff(value),
                            roff(option.get_description()));
    };
    for (const auto* argument : declared_arguments(command)) {
        add(argument->get_name(true), *argument);
    }
    for (const auto* option : declared_options(command)) {
        add(option->get_name(false, true), *option);
    }
    return text;
}

/// Lines as they are.
std::string verbatim(const std::string& text) {
    return text.empty() ? "" : fmt::format(".PP\n.nf\n{}\n.fi\n", roff(text));
}

std::string options_section(const CLI::App& command) {
    const auto text = entries(command);
    return text.empty() ? "" : ".SH OPTIONS\n" + text;
}

}  // namespace

std::string man_page_name(const CLI::App& command) {
    return page_name(command) + ".1";
}

std::string man_page(const CLI::App& command) {
    const bool is_program = command.get_parent() == nullptr;
    std::string upper = page_name(command);
    std::ranges::transform(upper, upper.begin(),
                           [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    std::string page = fmt::format(
        ".TH \"{}\" 1 \"\" \"merl\\-scan {}\" \"User Commands\"\n"
        ".SH NAME\n{} \\- {}\n"
        ".SH SYNOPSIS\n\\fB{}\\fR {}\n"
        ".SH DESCRIPTION\n{}\n",
        roff(upper), pipeline::kVersion, roff(page_name(command)), roff(title(command)),
        roff(full_name(command)), roff(usage(command)), roff(command.get_description()));
    page += options_section(command);
    std::string see;
    if (const auto commands = declared_commands(command); !commands.empty()) {
        page += ".SH COMMANDS\n";
        for (const auto* one : commands) {
            if (is_program) {
                page += fmt::format(".TP\n\\fB{}\\fR\n{}\n", roff(one->get_name()),
                                    roff(one->get_description()));
                see +=
                    fmt::format("{}.BR {} (1)", see.empty() ? "" : " ,\n", roff(page_name(*one)));
            } else {
                page += fmt::format(".SS \"{} {}\"\n{}\n{}{}", roff(full_name(*one)),
                                    roff(usage(*one)), roff(one->get_description()), entries(*one),
                                    verbatim(one->get_footer()));
            }
        }
    }
    if (const auto notes = verbatim(command.get_footer()); !notes.empty()) {
        page += ".SH NOTES\n" + notes.substr(std::string_view(".PP\n").size());
    }
    return page + ".SH SEE ALSO\n" + (is_program ? see : ".BR merl\\-scan (1)") + "\n";
}

}  // namespace merl::app
