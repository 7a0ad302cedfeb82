#include <memory>
#include <string>
#include <vector>

#include "app/cli/declared.h"
#include "app/cli/exit_status.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"

namespace merl::app {

void add_help(CLI::App& program, Command& chosen) {
    auto* command =
        program.add_subcommand("help", "The help of a command, as its --help prints it");
    auto words = std::make_shared<std::vector<std::string>>();
    command->add_option("command", *words, "A command; none: the program");
    command->footer(
        "Examples:\n"
        "  merl-scan help\n"
        "  merl-scan help scan\n"
        "  merl-scan help database write");
    command->callback([&chosen, &program, words] {
        chosen = [&program, words] {
            print_lines(help_of(find_command(program, *words)));
            return kSuccess;
        };
    });
}

}  // namespace merl::app
