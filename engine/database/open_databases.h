#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/material_choice.h"
#include "engine/database/open_database.h"

namespace merl::engine {

/// A database as open_database() takes it, and the label of its materials; empty: none was given.
struct NamedDatabase {
    std::string label = {};
    std::string name = {};
};

/// What is opened as one database.
struct DatabaseChoice {
    std::vector<NamedDatabase> databases = {};  // none: the built-in one
    std::optional<Grid> grid = {};              // where what has no grid of its own is evaluated;
                                                // over 2 pi what is over pi is repeated
    Grid evaluated_on = {};  // the same, unless the grid of others or `grid` says another
    std::optional<PhiDRange> phi_d_range = {};  // OpenOptions
    bool skip_bad = false;                      // OpenOptions
    WantedMaterials exactly = {};               // only these, called as the whole calls them
    MaterialChoice materials = {};              // of those, by patterns
    std::vector<BadMaterial> skipped = {};  // what was left out when `exactly` was first opened:
                                            // Database::skipped() says so again
};

/// The label of a database that was given none: the last component of the path, or the name of what
/// is in no file, or of the table of a model.
std::string default_label(const std::string& name);

/// Opens databases as one. A single one without a label is as open_database() opens it; several, or
/// one with a label, are joined (joined_database.h), and those of which no material is meant are
/// left out. A label that was not given is the last component of the path, or the name of what is
/// in no file. What is evaluated is so on the grid of the others, or MERL's where there is no
/// other, or `grid`.
///
/// Throws Error (usage) for what choose_materials() refuses, for bad labels, and for a label or a
/// database that is there twice; InputError where grids differ, what is named by `exactly` is not
/// there, and what open_database() throws.
std::unique_ptr<Database> open_databases(const DatabaseChoice& choice);

/// All materials that are meant, also those that cannot be used, called as open_databases() calls
/// them. What is evaluated has the grid of the first other material that can be used, or `grid`.
/// Throws as that does, but for what is wrong with single materials or differs between them.
DatabaseListing list_databases(const DatabaseChoice& choice);

}  // namespace merl::engine
