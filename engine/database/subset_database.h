#pragma once

#include <memory>
#include <vector>

#include "engine/database/database.h"

namespace merl::engine {

/// Some materials of another database, by their indices, ascending.
std::unique_ptr<Database> make_subset(std::shared_ptr<const Database> whole,
                                      std::vector<std::size_t> materials);

}  // namespace merl::engine
