#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/material_choice.h"

namespace merl::engine {

// Where databases are opened by name. To add a kind: write a class like merl_directory.cpp's or
// model_database.cpp's (or fill a MemoryDatabase), and add a line to the table in
// open_database.cpp, before the last one, which takes every name.

/// What the built-in database is called.
inline constexpr const char* kBuiltIn = "built-in";

/// The database that `name` means: kBuiltIn, or for that also nothing; a model or a table of one
/// (is_model()); otherwise a path. Throws InputError when what is wanted of it cannot be used, or
/// is not there.
std::unique_ptr<Database> open_database(const std::string& name, const OpenOptions& options = {});

/// Whether it has no grid of its own but is evaluated on any. Throws InputError when there is
/// nothing that could be one.
bool is_evaluated(const std::string& name);

/// A material of a database that may be broken in part, and what opens it alone, as a database of
/// one. That throws InputError when it is broken.
struct MaterialSource {
    std::string material;
    std::function<std::unique_ptr<Database>()> open;
};

/// What there is, whether it can be used or not.
struct DatabaseListing {
    std::string name;  // for people
    std::vector<MaterialSource> materials;
};

/// All materials of a database, also those that cannot be used; of `options` the grid and where
/// phi_d ends. Throws InputError when there is nothing that could be one.
DatabaseListing list_database(const std::string& name, const OpenOptions& options = {});

/// What open_database() takes, for people: "built-in, or a directory of ...".
std::string database_help();

}  // namespace merl::engine
