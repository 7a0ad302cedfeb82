#include "engine/database/open_databases.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <system_error>
#include <utility>

#include "engine/base/error.h"
#include "engine/database/bad_files.h"
#include "engine/database/joined_database.h"
#include "engine/database/model_database.h"
#include "engine/database/over_two_pi.h"

namespace merl::engine {
namespace {

namespace fs = std::filesystem;

/// One of those that were chosen.
struct Member {
    std::string label;  // empty: the only one, without a label
    std::string name;
    bool is_evaluated = false;
    WantedMaterials wanted = {};

    /// How the whole calls one of its materials.
    std::string full_name(const std::string& material) const {
        return label.empty() ? material : fmt::format("{}/{}", label, material);
    }
};

std::vector<Member> members_of(const DatabaseChoice& choice) {
    std::vector<Member> members;
    for (const auto& [label, name] : choice.databases) {
        members.push_back({label, name.empty() ? kBuiltIn : name, is_evaluated(name)});
    }
    if (members.empty()) {
        members.push_back({"", kBuiltIn, is_evaluated(kBuiltIn)});
    }
    for (auto& member : members) {
        if (members.size() > 1 && member.label.empty()) {
            member.label = default_label(member.name);
        }
        if (members.size() > 1 || !member.label.empty()) {
            require_label(member.label, member.name);
        }
    }
    for (auto a = members.begin(); a != members.end(); ++a) {
        for (auto b = members.begin(); b != a; ++b) {
            if (a->name == b->name) {
                throw Error(Fault::usage, fmt::format("{} is named twice; name it once", a->name));
            }
            if (a->label == b->label) {
                throw Error(Fault::usage, fmt::format("{} and {} both have the label \"{}\"; give "
                                                      "them others: --database LABEL=PATH",
                                                      b->name, a->name, a->label));
            }
        }
    }
    return members;
}

std::string names_of(const std::vector<Member>& members) {
    std::vector<std::string> names;
    std::ranges::transform(members, std::back_inserter(names), &Member::name);
    return fmt::format("{}", fmt::join(names, ", "));
}

/// All materials as the whole calls them, ascending.
std::vector<std::string> all_names(const std::vector<Member>& members) {
    std::vector<std::string> names;
    for (const auto& member : members) {
        for (const auto& source : list_database(member.name).materials) {
            names.push_back(member.full_name(source.material));
        }
    }
    std::ranges::sort(names);
    return names;
}

/// Those materials, as the whole calls them, to which a choice comes down; none: all.
WantedMaterials wanted_of(const std::vector<Member>& members, const DatabaseChoice& choice) {
    if (choice.materials.is_all()) {
        return choice.exactly;
    }
    const auto names = choice.exactly ? *choice.exactly : all_names(members);
    WantedMaterials wanted(std::in_place);
    for (const auto m : choose_materials(names, choice.materials, names_of(members))) {
        wanted->push_back(names[m]);
    }
    return wanted;
}

/// Gives each member those of its materials that are wanted.
void want(std::vector<Member>& members, const std::vector<std::string>& names) {
    for (auto& member : members) {
        member.wanted.emplace();
    }
    for (const auto& name : names) {
        const auto member = std::ranges::find_if(members, [&](const Member& m) {
            return m.label.empty() || name.starts_with(m.label + '/');
        });
        if (member == members.end()) {
            throw InputError(fmt::format("{}: found no database with the label of \"{}\"",
                                         names_of(members), name));
        }
        member->wanted->push_back(name.substr(member->full_name("").size()));
    }
    std::erase_if(members, [](const Member& m) { return m.wanted->empty(); });
}

std::vector<Member> wanted_members(const DatabaseChoice& choice) {
    auto members = members_of(choice);
    if (const auto wanted = wanted_of(members, choice)) {
        want(members, *wanted);
    }
    return members;
}

/// That of a material; none where it cannot be used.
std::optional<Grid> grid_of(const MaterialSource& source) {
    try {
        return source.open()->grid();
    } catch (const InputError&) {
        return std::nullopt;
    }
}

}  // namespace

std::string default_label(const std::string& name) {
    if (is_model(name) && name.find(':') != std::string::npos) {
        return fs::path(name.substr(name.find(':') + 1)).stem().string();
    }
    const fs::path path = fs::absolute(name).lexically_normal();
    const fs::path last = path.has_filename() ? path.filename() : path.parent_path().filename();
    std::error_code none;
    return (fs::is_directory(path, none) ? last : last.stem()).string();
}

std::unique_ptr<Database> open_databases(const DatabaseChoice& choice) {
    auto members = wanted_members(choice);
    // Those with a grid of their own first: the others take it.
    std::ranges::stable_sort(members, {}, &Member::is_evaluated);
    std::vector<LabelledDatabase> opened;
    // Over pi: what is evaluated is reciprocal, and repeated where files go to 2 pi.
    Grid grid = choice.grid.value_or(choice.evaluated_on).over_pi();
    std::vector<std::string> bad;
    std::vector<std::string> nothing_good;  // with choice.skip_bad
    std::vector<BadMaterial> skipped = choice.skipped;
    for (const auto& member : members) {
        std::unique_ptr<Database> database;
        try {
            database = open_database(member.name, {.grid = grid,
                                                   .materials = member.wanted,
                                                   .phi_d_range = choice.phi_d_range,
                                                   .skip_bad = choice.skip_bad});
        } catch (const NoGoodFileError& error) {
            if (members.size() == 1) {
                throw;
            }
            nothing_good.emplace_back(error.what());
            for (const auto& [material, reason] : error.bad()) {
                skipped.push_back({member.full_name(material), reason});
            }
            continue;
        } catch (const BadFilesError& error) {
            if (members.size() == 1) {
                throw;
            }
            bad.emplace_back(error.what());
            continue;
        }
        if (choice.grid && database->grid().over_pi() != grid) {
            throw InputError(fmt::format("{}: the grid is {}, which files keep; {} was asked for",
                                         database->place_of(0), database->grid().text(),
                                         grid.text()));
        }
        grid = opened.empty() ? database->grid().over_pi() : grid;
        const bool repeats = choice.grid && choice.grid->phi_d_range == PhiDRange::two_pi &&
                             database->grid().phi_d_range == PhiDRange::pi;
        if (repeats) {  // as what was beside it made it
            database = repeat_over_two_pi(std::move(database));
        }
        if (member.label.empty()) {
            database->add_skipped(skipped);
            return database;
        }
        opened.push_back({member.label, std::move(database)});
    }
    if (!bad.empty()) {
        throw BadFilesError(bad);
    }
    if (opened.empty()) {
        throw BadFilesError(nothing_good);
    }
    auto joined = make_joined(std::move(opened));
    joined->add_skipped(skipped);
    require_usable(*joined);
    return joined;
}

DatabaseListing list_databases(const DatabaseChoice& choice) {
    auto members = wanted_members(choice);
    std::ranges::stable_sort(members, {}, &Member::is_evaluated);
    std::optional<Grid> grid = choice.grid;
    DatabaseListing listing;
    std::vector<std::string> names;
    for (const auto& member : members) {
        auto part = list_database(member.name, {.grid = grid.value_or(Grid{}).over_pi(),
                                                .phi_d_range = choice.phi_d_range});
        names.push_back(part.name);
        for (auto& source : part.materials) {
            if (member.wanted && !std::ranges::binary_search(*member.wanted, source.material)) {
                continue;
            }
            if (!grid && !member.is_evaluated) {
                grid = grid_of(source);
            }
            source.material = member.full_name(source.material);
            listing.materials.push_back(std::move(source));
        }
    }
    std::ranges::sort(listing.materials, {}, &MaterialSource::material);
    listing.name = fmt::format("{}", fmt::join(names, ", "));
    return listing;
}

}  // namespace merl::engine
