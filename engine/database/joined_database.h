#pragma once

#include <memory>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// A database, and what tells its materials from those of others.
struct LabelledDatabase {
    std::string label;
    std::shared_ptr<const Database> database;
};

/// Throws Error (usage) that says what is wrong with a label of the database `name`. A label is
/// text without a slash, which ends it in "label/name", without a "=", which ends it where people
/// write it and in names of files (file_stem), and without characters that nobody sees; it does not
/// begin with a dot, and is not empty.
void require_label(const std::string& label, const std::string& name);

/// One database of several, or of one under a label: its materials are called "label/name",
/// ascending bytewise, and each reads as it does by itself; where one goes to 2 pi in phi_d the
/// others are repeated, f(phi_d + pi) = f(phi_d). Throws Error (usage) for a bad label, and for a
/// label or a place that is there twice, InputError that names two databases of different grids,
/// and std::invalid_argument when there is none, or one of them is joined itself.
std::unique_ptr<Database> make_joined(std::vector<LabelledDatabase> databases);

}  // namespace merl::engine
