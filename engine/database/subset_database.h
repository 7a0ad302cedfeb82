#pragma once

#include <memory>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// Some materials of another database, by their indices, ascending. Throws std::invalid_argument
/// when they are not, or there are not so many.
std::unique_ptr<Database> make_subset(std::shared_ptr<const Database> whole,
                                      std::vector<std::size_t> materials);

}  // namespace merl::engine
