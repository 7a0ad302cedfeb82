#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>
#include <vector>

#include "engine/database/open_database.h"

namespace merl::app {

/// The options of every command that takes a database.
struct DatabaseOptions {
    std::string database;  // as engine::open_database() takes it
    engine::OpenOptions opening = {};
};

/// Adds --database, --skip-bad and --phi-d-range; `more` is what else the description of --database
/// says. Returns all of them.
std::vector<CLI::Option*> add_database_options(CLI::App& command, DatabaseOptions& options,
                                               const std::string& more = "(default: built-in)");

/// Adds --phi-d-range alone.
CLI::Option* add_phi_d_range_option(CLI::App& command, engine::OpenOptions& options);

/// Opens what the options name. Throws what engine::open_database() throws.
std::unique_ptr<engine::Database> open_database(const DatabaseOptions& options);

/// The same, and warns of what is skipped.
std::unique_ptr<engine::Database> open_database_and_warn(const DatabaseOptions& options);

}  // namespace merl::app
