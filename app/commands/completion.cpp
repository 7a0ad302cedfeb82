#include "app/cli/completion.h"

#include <memory>
#include <string>

#include "app/cli/exit_status.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"

namespace merl::app {

void add_completion(CLI::App& program, Command& chosen) {
    auto* command = program.add_subcommand(
        "completion", "What completes commands and options in bash, zsh or fish");
    auto shell = std::make_shared<std::string>();
    command->add_option("shell", *shell, "bash, zsh or fish")
        ->required()
        ->transform(CLI::Validator(
            [](const std::string& text) {
                const bool known = text == "bash" || text == "zsh" || text == "fish";
                return known ? std::string() : "expected bash, zsh or fish, found \"" + text + "\"";
            },
            ""));
    command->footer(
        "Examples:\n"
        "  merl-scan completion fish > ~/.config/fish/completions/merl-scan.fish\n"
        "  source <(merl-scan completion bash)                   in ~/.bashrc\n"
        "  source <(merl-scan completion zsh)                    in ~/.zshrc, after compinit");
    command->callback([&chosen, &program, shell] {
        chosen = [&program, shell] {
            print_lines(*shell == "bash"  ? bash_completion(program)
                        : *shell == "zsh" ? zsh_completion(program)
                                          : fish_completion(program));
            return kSuccess;
        };
    });
}

}  // namespace merl::app
