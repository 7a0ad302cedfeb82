#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/database/open_databases.h"

namespace merl::app {

/// The options of every command that takes a database.
struct DatabaseOptions {
    std::vector<std::string> databases;  // [LABEL=]PATH|NAME each
    engine::MaterialChoice materials;
    std::string grid;                                   // "90x90x180"; empty: none was asked for
    std::optional<engine::PhiDRange> phi_d_range = {};  // of MERL files; none: as their sizes say
    bool skip_bad = false;
    engine::DatabaseChoice otherwise = {};  // what is used if `databases` is empty; of it else only
                                            // evaluated_on and phi_d_range, if none is given

    /// What is to be opened. Throws Error (usage) where a text is none of these.
    engine::DatabaseChoice choice() const;
};

/// Adds --database, --skip-bad and what add_material_options() adds; `more` is what else the
/// description of --database says. Returns all of them.
std::vector<CLI::Option*> add_database_options(CLI::App& command, DatabaseOptions& options,
                                               const std::string& more = "(default: built-in)");

/// Adds --materials, --exclude, --grid and --phi-d-range. Returns them.
std::vector<CLI::Option*> add_material_options(CLI::App& command, DatabaseOptions& options);

/// Opens what the options name. Throws what choice() and engine::open_databases() throw.
std::unique_ptr<engine::Database> open_database(const DatabaseOptions& options);

/// The same, and warns of what is skipped.
std::unique_ptr<engine::Database> open_database_and_warn(const DatabaseOptions& options);

/// What --database takes, for footers of --help.
inline constexpr const char* kDatabaseHelp =
    "A database is [LABEL=]PATH, or [LABEL=] and built-in, a model (merl-scan models), "
    "MODEL:TABLE.csv or blends:N.\n"
    "With several, or a LABEL, materials are called label/name; the last part of the path is the "
    "label where none is given. --materials and\n"
    "--exclude take names and patterns with commas between them, and @FILE with one a line.\n";

}  // namespace merl::app
