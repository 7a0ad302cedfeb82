#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/database/model.h"

namespace merl::engine {

// Databases of materials that a model (model.h) computes from a few figures each. Any grid can be
// asked for; nothing is ever "not measured", and below the horizon it is zero.

/// The model that is the built-in database.
inline constexpr const char* kBuiltInModel = "abc";

/// Database::kind() of a model with its own table: a stand-in for what was measured.
inline constexpr const char* built_in_kind = "built-in stand-in";

/// Whether `name` is that of a model, "ward", or of a user's table for one, "ward:params.csv". A
/// folder of such a name is "./ward".
bool is_model(const std::string& name);

/// The database of such a name; by its path() it can be opened again. Throws InputError on a table
/// that cannot be read or used, and where `name` is none.
std::unique_ptr<Database> open_model(const std::string& name, const Grid& grid = {});

/// The model with the materials of a table, the text of a CSV file: `material` and the columns of
/// the model's parameters, in any order, a row per material. `name` is what the database is called,
/// and what errors call the table. Throws InputError that names the line and the column.
std::unique_ptr<Database> make_model_database(const Model& model, const std::string& table,
                                              const std::string& name, const Grid& grid = {});

/// The names of the 100 materials of MERL, ascending bytewise.
std::vector<std::string> merl_materials();

}  // namespace merl::engine
