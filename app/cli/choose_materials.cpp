#include "app/cli/choose_materials.h"

#include <fmt/format.h>

#include <algorithm>

#include "engine/base/error.h"

namespace merl::app {

std::vector<std::size_t> find_materials(const engine::Database& database,
                                        const std::vector<std::string>& values) {
    const auto& names = database.materials();
    std::vector<std::string> wanted;
    for (const auto& value : values) {
        if (std::find(names.begin(), names.end(), value) != names.end()) {
            wanted.push_back(value);
            continue;
        }
        std::size_t begin = 0;
        for (auto end = value.find(','); end != std::string::npos; end = value.find(',', begin)) {
            wanted.push_back(value.substr(begin, end - begin));
            begin = end + 1;
        }
        wanted.push_back(value.substr(begin));
    }
    std::vector<std::size_t> materials;
    for (const auto& name : wanted) {
        const auto found = std::find(names.begin(), names.end(), name);
        if (found == names.end()) {
            throw Error(Fault::usage,
                        fmt::format("{} has no material \"{}\"; `merl-scan database info` "
                                    "lists its {} materials",
                                    database.name(), name, names.size()));
        }
        const auto index = static_cast<std::size_t>(found - names.begin());
        if (std::find(materials.begin(), materials.end(), index) == materials.end()) {
            materials.push_back(index);
        }
    }
    return materials;
}

}  // namespace merl::app
