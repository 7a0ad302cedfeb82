#include <fmt/format.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/declared.h"
#include "app/cli/exit_status.h"
#include "app/cli/man_page.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "engine/base/error.h"

namespace merl::app {
namespace {

/// Writes a page into the directory, in the place of an older one.
void write_page(const std::string& directory, const CLI::App& command) {
    const auto path = std::filesystem::path(directory) / man_page_name(command);
    std::ofstream file(path, std::ios::binary | std::ios::trunc);
    file << man_page(command);
    file.close();
    if (!file) {
        throw Error(Fault::output,
                    fmt::format("{}: cannot be written; is {} a directory that you may write to?",
                                path.string(), directory));
    }
}

}  // namespace

void add_man(CLI::App& program, Command& chosen) {
    auto* command = program.add_subcommand("man", "The manual page of a command, for man");
    struct Options {
        std::vector<std::string> words;
        std::string out;
    };
    auto options = std::make_shared<Options>();
    auto* words = command->add_option("command", options->words, "A command; none: the program");
    command
        ->add_option("--out", options->out,
                     "An existing directory to write all pages into, merl-scan.1 and one a command")
        ->transform(not_empty())
        ->excludes(words);
    command->footer(
        "Examples:\n"
        "  merl-scan man scan | man -l -\n"
        "  mkdir -p ~/.local/share/man/man1\n"
        "  merl-scan man --out ~/.local/share/man/man1           then: man merl-scan-scan");
    command->callback([&chosen, &program, options] {
        chosen = [&program, options] {
            if (options->out.empty()) {
                print_lines(man_page(find_command(program, options->words)));
                return kSuccess;
            }
            write_page(options->out, program);
            for (const auto* one : declared_commands(program)) {
                write_page(options->out, *one);
            }
            return kSuccess;
        };
    });
}

}  // namespace merl::app
