#include "app/cli/database_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <optional>
#include <string_view>

#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "engine/base/error.h"
#include "engine/base/number.h"
#include "engine/database/bad_files.h"
#include "engine/database/joined_database.h"
#include "engine/database/model_database.h"

namespace merl::app {
namespace {

/// A path as a shell would have it, which leaves a ~ alone that follows a "=" or the ":" of a
/// model's table, or is quoted.
std::string with_home(const std::string& path) {
    const auto colon = path.find(':');
    if (engine::is_model(path) && colon != std::string::npos) {
        return path.substr(0, colon + 1) + with_home(path.substr(colon + 1));
    }
    const char* const home = std::getenv("HOME");
    const bool begins = path == "~" || path.starts_with("~/");
    return begins && home != nullptr ? home + path.substr(1) : path;
}

/// Patterns with commas between them, of which an @~/FILE is in the home directory.
std::string with_home_in_lists(const std::string& patterns) {
    std::string text;
    for (std::size_t begin = 0; begin <= patterns.size();) {
        const std::size_t end = std::min(patterns.find(',', begin), patterns.size());
        const std::string item = patterns.substr(begin, end - begin);
        text += begin == 0 ? "" : ",";
        text += item.starts_with('@') ? '@' + with_home(item.substr(1)) : item;
        begin = end + 1;
    }
    return text;
}

CLI::Validator expanded_lists() {
    return {[](std::string& patterns) {
                patterns = with_home_in_lists(patterns);
                return std::string();
            },
            ""};
}

/// "[LABEL=]PATH|NAME": what is before the first "=" is a label unless it has a slash.
engine::NamedDatabase named_database(const std::string& text) {
    const std::size_t end = text.find_first_of("=/");
    if (end == std::string::npos || text[end] == '/') {
        return {.name = with_home(text)};
    }
    engine::NamedDatabase named = {text.substr(0, end), with_home(text.substr(end + 1))};
    if (named.name.empty()) {
        throw Error(
            Fault::usage,
            fmt::format("--database {}: found nothing after the \"=\"; expected LABEL=PATH", text));
    }
    engine::require_label(named.label, named.name);  // none at all is no label either
    return named;
}

/// "theta_h x theta_d x phi_d" without the spaces.
std::optional<engine::Grid> parse_grid(std::string_view text) {
    std::array<std::uint32_t, 3> sides = {};
    for (std::size_t i = 0; i < sides.size(); ++i) {
        const std::size_t end = i + 1 < sides.size() ? text.find('x') : text.size();
        const auto side = parse_number<std::uint32_t>(text.substr(0, end));
        if (end == std::string_view::npos || !side || *side < 1 || *side > engine::kMaxSide) {
            return std::nullopt;
        }
        sides[i] = *side;
        text.remove_prefix(std::min(end + 1, text.size()));
    }
    const engine::Grid grid = {.theta_h = sides[0], .theta_d = sides[1], .phi_d = sides[2]};
    return grid.voxels() <= engine::kMaxVoxels ? std::optional(grid) : std::nullopt;
}

CLI::Validator grid_sides() {
    return {[](const std::string& text) {
                return parse_grid(text)
                           ? std::string()
                           : fmt::format(
                                 "expected theta_h x theta_d x phi_d like 90x90x180, each "
                                 "from 1 to {} and at most {} voxels, found \"{}\"",
                                 engine::kMaxSide, engine::kMaxVoxels, text);
            },
            ""};
}

}  // namespace

engine::DatabaseChoice DatabaseOptions::choice() const {
    engine::DatabaseChoice choice;
    if (databases.empty()) {
        choice = otherwise;
    } else {
        choice.evaluated_on = otherwise.evaluated_on;
        choice.phi_d_range = otherwise.phi_d_range;
    }
    for (const auto& text : databases) {
        choice.databases.push_back(named_database(text));
    }
    choice.materials = materials;
    if (!grid.empty()) {
        choice.grid = parse_grid(grid);
    }
    if (phi_d_range) {
        choice.phi_d_range = phi_d_range;
    }
    choice.skip_bad = skip_bad;
    return choice;
}

std::vector<CLI::Option*> add_database_options(CLI::App& command, DatabaseOptions& options,
                                               const std::string& more) {
    std::vector<CLI::Option*> added = {
        command
            .add_option("--database", options.databases,
                        fmt::format("[LABEL=]PATH or NAME: {}; the option more than once joins "
                                    "databases {}",
                                    engine::database_help(), more))
            ->transform(not_empty())
            ->expected(1)
            ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll),
        command.add_flag(
            "--skip-bad", options.skip_bad,
            "Leave out files that cannot be used, and list them; reads all once more")};
    const auto others = add_material_options(command, options);
    added.insert(added.end(), others.begin(), others.end());
    return added;
}

std::vector<CLI::Option*> add_material_options(CLI::App& command, DatabaseOptions& options) {
    const std::map<std::string, engine::PhiDRange> ranges = {
        {engine::range_name(engine::PhiDRange::pi), engine::PhiDRange::pi},
        {engine::range_name(engine::PhiDRange::two_pi), engine::PhiDRange::two_pi}};
    return {command
                .add_option("--materials,--material", options.materials.materials,
                            "Only these materials: names or patterns like 'gold-*', with commas "
                            "between them, or @FILE with one a line")
                ->transform(expanded_lists()),
            command
                .add_option("--exclude", options.materials.exclude,
                            "All but these, named in the same way")
                ->transform(expanded_lists()),
            command
                .add_option("--grid", options.grid,
                            "The grid of what can be evaluated on any, theta_h x theta_d x phi_d "
                            "(default: that of the other databases, or 90x90x180)")
                ->transform(grid_sides()),
            command
                .add_option_function<std::string>(
                    "--phi-d-range",
                    [&options, ranges](const std::string& name) {
                        options.phi_d_range = ranges.at(name);
                    },
                    "Where phi_d of MERL files ends (default: 2pi where there are four times as "
                    "many phi_d as theta_d, else pi)")
                ->check(CLI::IsMember(ranges))};
}

std::unique_ptr<engine::Database> open_database(const DatabaseOptions& options) {
    return engine::open_databases(options.choice());
}

std::unique_ptr<engine::Database> open_database_and_warn(const DatabaseOptions& options) {
    auto database = open_database(options);
    std::ranges::for_each(engine::skipped_lines(*database), print_warning);
    return database;
}

}  // namespace merl::app
