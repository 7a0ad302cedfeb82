#include "engine/database/open_database.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

#include "engine/base/error.h"
#include "engine/database/blends_database.h"
#include "engine/database/merl_directory.h"
#include "engine/database/model_database.h"
#include "engine/database/other_formats.h"
#include "engine/database/rgl_database.h"
#include "engine/database/subset_database.h"

namespace merl::engine {
namespace {

/// A kind of database.
struct Kind {
    const char* help;  // what --help says that one may name
    /// Whether a name means one of this kind.
    bool (*recognises)(const std::string& name);
    bool is_evaluated;  // on any grid
    std::unique_ptr<Database> (*open)(const std::string& name, const OpenOptions& options);
    /// Its materials one by one, where some may be broken; null: it is whole or cannot be opened.
    std::vector<MaterialSource> (*list)(const std::string& name,
                                        const OpenOptions& options) = nullptr;
};

std::vector<MaterialSource> sources_of(
    const std::vector<MaterialFile>& files,
    const std::function<std::unique_ptr<Database>(const std::filesystem::path&)>& open) {
    std::vector<MaterialSource> sources;
    sources.reserve(files.size());
    for (const auto& file : files) {
        sources.push_back({file.material, [file, open] { return open(file.path); }});
    }
    return sources;
}

/// The first that recognises a name opens it; the last one recognises all.
const std::array kKinds = {
    Kind{"built-in (the stand-in database)",
         [](const std::string& name) { return name.empty() || name == kBuiltIn; }, true,
         [](const std::string&, const OpenOptions& options) {
             return open_model(kBuiltInModel, options.grid);
         }},
    Kind{"a model (merl-scan models), or MODEL:TABLE.csv (a table of its parameters)", is_model,
         true,
         [](const std::string& name, const OpenOptions& options) {
             return open_model(name, options.grid);
         }},
    Kind{"blends:N (N materials: the built-in ones and blends of them)", is_blends, true,
         [](const std::string& name, const OpenOptions& options) {
             return open_blends(name, options.grid);
         }},
    Kind{"a directory of RGL .bsdf files (isotropic, RGB)",
         [](const std::string& name) { return is_rgl(name); }, true,
         [](const std::string& name, const OpenOptions& options) {
             return open_rgl_directory(name, options);
         },
         [](const std::string& name, const OpenOptions& options) {
             return sources_of(list_rgl_files(name), [grid = options.grid](const auto& path) {
                 return open_rgl_file(path, grid);
             });
         }},
    Kind{"a directory of MERL .binary files", [](const std::string&) { return true; }, false,
         [](const std::string& name, const OpenOptions& options) {
             return open_merl_directory(name, options);
         },
         [](const std::string& name, const OpenOptions& options) {
             const OpenOptions range = {.phi_d_range = options.phi_d_range};
             return sources_of(list_merl_files(name),
                               [range](const auto& path) { return open_merl_file(path, range); });
         }},
};

const Kind& kind_of(const std::string& name) {
    std::error_code none;
    if (!name.empty() && name != kBuiltIn && !is_model(name) && !is_blends(name) &&
        !std::filesystem::exists(name, none)) {
        throw InputError(
            fmt::format("{}: there is no such database; expected {}", name, database_help()));
    }
    return *std::ranges::find_if(kKinds, [&](const Kind& kind) { return kind.recognises(name); });
}

/// Those materials of a database that are wanted, where opening it did not leave out the others.
std::unique_ptr<Database> only(std::unique_ptr<Database> database, const WantedMaterials& wanted) {
    const auto& names = database->materials();
    if (!wanted || names == *wanted) {
        return database;
    }
    std::vector<std::size_t> places;
    for (const auto& name : *wanted) {
        const auto place = std::ranges::lower_bound(names, name);
        if ((place == names.end() || *place != name) &&
            std::ranges::binary_search(database->skipped(), name, {}, &BadMaterial::material)) {
            continue;
        }
        if (place == names.end() || *place != name) {
            throw InputError(fmt::format("{}: found no material \"{}\" among its {}",
                                         database->name(), name, names.size()));
        }
        places.push_back(static_cast<std::size_t>(place - names.begin()));
    }
    return make_subset(std::move(database), std::move(places));
}

}  // namespace

std::unique_ptr<Database> open_database(const std::string& name, const OpenOptions& options) {
    require_usable(options.grid, name);
    auto database = kind_of(name).open(name, options);
    require_usable(*database);
    return only(std::move(database), options.materials);
}

bool is_evaluated(const std::string& name) {
    return kind_of(name).is_evaluated;
}

DatabaseListing list_database(const std::string& name, const OpenOptions& options) {
    require_usable(options.grid, name);
    const auto& kind = kind_of(name);
    if (kind.list != nullptr) {
        auto materials = kind.list(name, options);
        if (materials.empty()) {
            throw InputError(fmt::format("{}: has no materials; expected {}{}", name,
                                         database_help(), directory_known_as(name)));
        }
        return {name, std::move(materials)};
    }
    const std::shared_ptr<const Database> whole = kind.open(name, options);
    std::vector<MaterialSource> sources;
    for (std::size_t m = 0; m < whole->materials().size(); ++m) {
        sources.push_back({whole->materials()[m], [whole, m] { return make_subset(whole, {m}); }});
    }
    return {whole->name(), std::move(sources)};
}

std::string database_help() {
    std::string help;
    for (const auto& kind : kKinds) {
        help += fmt::format("{}{}", help.empty() ? "" : ", or ", kind.help);
    }
    return help;
}

}  // namespace merl::engine
