#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/database/database.h"

namespace merl::app {

/// Indices of the materials named by the values of an option, each of which is a name or, if there
/// is none like that, names with commas between them. None is there twice. Throws Error (usage) for
/// a name that the database does not have.
std::vector<std::size_t> find_materials(const engine::Database& database,
                                        const std::vector<std::string>& values);

}  // namespace merl::app
