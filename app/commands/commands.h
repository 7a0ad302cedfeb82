#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace merl::app {

/// What a chosen subcommand does; it returns the exit status of the program.
using Command = std::function<int()>;

// Each adds its subcommand with its options to the program's. When the user chooses it, `chosen`
// becomes what there is to do. One file per subcommand.
void add_scan(CLI::App& program, Command& chosen);
void add_distances(CLI::App& program, Command& chosen);
void add_compare(CLI::App& program, Command& chosen);
void add_devices(CLI::App& program, Command& chosen);
void add_metrics(CLI::App& program, Command& chosen);
void add_models(CLI::App& program, Command& chosen);
void add_database(CLI::App& program, Command& chosen);
void add_verify(CLI::App& program, Command& chosen);
void add_score(CLI::App& program, Command& chosen);
void add_tune(CLI::App& program, Command& chosen);
void add_slices(CLI::App& program, Command& chosen);
void add_judge(CLI::App& program, Command& chosen);
void add_render(CLI::App& program, Command& chosen);
void add_votes(CLI::App& program, Command& chosen);
void add_power(CLI::App& program, Command& chosen);
void add_cite(CLI::App& program, Command& chosen);
void add_help(CLI::App& program, Command& chosen);
void add_man(CLI::App& program, Command& chosen);
void add_completion(CLI::App& program, Command& chosen);
void add_guarded(CLI::App& program, Command& chosen);

}  // namespace merl::app
