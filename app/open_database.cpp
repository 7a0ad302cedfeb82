#include "app/commands.h"
#include "engine/reflectance/abc_database.h"
#include "engine/reflectance/merl_directory.h"

namespace merl::app {

std::unique_ptr<reflectance::Database> open_database(const std::string& path) {
    return path.empty() || path == kBuiltIn ? reflectance::make_abc_database()
                                            : reflectance::open_merl_directory(path);
}

}  // namespace merl::app
