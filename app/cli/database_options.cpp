#include "app/cli/database_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "engine/database/bad_files.h"

namespace merl::app {

std::vector<CLI::Option*> add_database_options(CLI::App& command, DatabaseOptions& options,
                                               const std::string& more) {
    return {
        command
            .add_option("--database", options.database,
                        fmt::format("{} {}", engine::database_help(), more))
            ->transform(not_empty()),
        command.add_flag("--skip-bad", options.opening.skip_bad,
                         "Leave out files that cannot be used, and list them; reads all once more"),
        add_phi_d_range_option(command, options.opening)};
}

CLI::Option* add_phi_d_range_option(CLI::App& command, engine::OpenOptions& options) {
    const std::map<std::string, engine::PhiDRange> ranges = {
        {engine::range_name(engine::PhiDRange::pi), engine::PhiDRange::pi},
        {engine::range_name(engine::PhiDRange::two_pi), engine::PhiDRange::two_pi}};
    return command
        .add_option_function<std::string>(
            "--phi-d-range",
            [&options, ranges](const std::string& name) { options.phi_d_range = ranges.at(name); },
            "Where phi_d of MERL files ends (default: 2pi where there are four times as many phi_d "
            "as theta_d, else pi)")
        ->check(CLI::IsMember(ranges));
}

std::unique_ptr<engine::Database> open_database(const DatabaseOptions& options) {
    return engine::open_database(options.database, options.opening);
}

std::unique_ptr<engine::Database> open_database_and_warn(const DatabaseOptions& options) {
    auto database = open_database(options);
    std::ranges::for_each(engine::skipped_lines(*database), print_warning);
    return database;
}

}  // namespace merl::app
