#include "app/commands/commands.h"
#include "engine/database/abc_database.h"
#include "engine/database/merl_directory.h"

namespace merl::app {

std::unique_ptr<engine::Database> open_database(const std::string& path) {
    return path.empty() || path == kBuiltIn ? engine::make_abc_database()
                                            : engine::open_merl_directory(path);
}

}  // namespace merl::app
