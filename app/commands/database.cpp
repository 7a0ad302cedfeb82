#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <iterator>
#include <limits>
#include <memory>
#include <span>
#include <system_error>
#include <vector>

#include "app/cli/database_options.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/output_directory.h"
#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/damage.h"
#include "engine/database/domain.h"
#include "engine/database/merl_file.h"
#include "engine/database/open_databases.h"
#include "scan/io/csv.h"

namespace merl::app {
namespace {

using engine::Grid;
using engine::VoxelRange;
using engine::VoxelRun;

struct Options {
    DatabaseOptions database;
    std::string out;
    bool force = false;
    bool quiet = false;
};

/// What `database info` says of one material.
struct Content {
    std::uint64_t negative = 0;
    double least = std::numeric_limits<double>::infinity();  // of the measured numbers
    double most = 0;
    std::string hash;
    std::string fault;  // why it looks like a broken copy; empty: it does not
};

/// The voxels above the horizon, of the grid that was asked for last.
class Horizon {
  public:
    const std::vector<VoxelRun>& runs(const Grid& grid) {
        if (grid != grid_ || runs_.empty()) {
            const engine::VoxelList list(engine::Domain(grid), engine::VoxelSet::above_horizon);
            runs_ = list.runs(0, list.size());
            grid_ = grid;
        }
        return runs_;
    }

  private:
    Grid grid_;
    std::vector<VoxelRun> runs_;
};

/// Those of the runs that are in a range of the file, cut at its ends.
std::vector<VoxelRun> runs_within(const std::vector<VoxelRun>& runs, VoxelRange range) {
    std::vector<VoxelRun> within;
    auto run = std::ranges::partition_point(
        runs, [&](const auto& r) { return r.file_index + r.length <= range.first; });
    for (; run != runs.end() && run->file_index < range.last; ++run) {
        const std::uint64_t first = std::max(run->file_index, range.first);
        const std::uint64_t last = std::min(run->file_index + run->length, range.last);
        within.push_back({.file_index = first, .position = 0, .length = last - first});
    }
    return within;
}

/// Goes through the one material of a database. `progress` is called with the share of it that is
/// done.
Content content_of(const engine::Database& database, const std::vector<VoxelRun>& above_horizon,
                   const std::function<void(double)>& progress) {
    const Grid& grid = database.grid();
    Content content;
    engine::ContentHash hash(1);
    engine::DamageCheck check(grid);
    std::uint64_t negative_above = 0;
    const auto look_at = [&](VoxelRange range, std::span<const double> samples) {
        const auto is_negative = [&](std::uint64_t i) {
            return std::min(
                       {samples[i], samples[range.size() + i], samples[2 * range.size() + i]}) < 0;
        };
        for (std::uint64_t i = 0; i < range.size(); ++i) {
            content.negative += is_negative(i) ? 1 : 0;
        }
        for (const double value : samples) {
            if (value >= 0) {
                content.least = std::min(content.least, value);
                content.most = std::max(content.most, value);
            }
        }
        const auto above = runs_within(above_horizon, range);
        for (const auto& run : above) {
            for (std::uint64_t i = 0; i < run.length; ++i) {
                negative_above += is_negative(run.file_index - range.first + i) ? 1 : 0;
            }
        }
        check.add(range, samples, above);
        progress(static_cast<double>(range.last) / static_cast<double>(grid.voxels()));
    };
    engine::read_material(database, 0, hash.sink(0), look_at);
    content.hash = hash.material_digest(0, grid.text());
    content.fault = check.fault(negative_above, hash, 0);
    return content;
}

void print_heading() {
    print_line("");
    print_line(fmt::format("{:<32} {:>12} {:>12}   {}", "material", "samples", "negative",
                           "values, 1/sr"));
}

void print_row(const std::string& material, const Grid& grid, const Content& content) {
    const auto values = content.least > content.most
                            ? std::string("nothing was measured")
                            : fmt::format("{:.6g} to {:.6g}", content.least, content.most);
    print_line(fmt::format("{:<32} {:>12} {:>12}   {}", material, grid.voxels(), content.negative,
                           values));
    if (!content.fault.empty()) {
        print_line(fmt::format("{:<32} looks damaged: {}", material, content.fault));
    }
}

/// Progress over several materials; call it with the share of one of them.
auto share_of(Progress& progress, std::size_t material, std::size_t count) {
    return [&progress, material, count](double share) {
        progress.update((static_cast<double>(material) + share) / static_cast<double>(count));
    };
}

/// Whether materials of these grids can be in one database.
bool have_one_grid(const std::vector<Grid>& grids) {
    return std::ranges::all_of(
        grids, [&](const Grid& grid) { return grid.over_pi() == grids.front().over_pi(); });
}

/// What the grids of materials have in common, in words that follow.
std::string grid_text(const std::vector<Grid>& grids) {
    if (grids.empty()) {
        return "";
    }
    if (!have_one_grid(grids)) {
        return "; their grids differ, and a scan needs one grid";
    }
    const auto to_pi = static_cast<std::uint64_t>(
        std::ranges::count(grids, engine::PhiDRange::pi, &Grid::phi_d_range));
    if (to_pi == grids.size()) {
        return fmt::format("; grid {}, phi_d over [0, pi)", grids.front().text());
    }
    const auto repeated = to_pi == 0
                              ? std::string()
                              : fmt::format("; {} over [0, pi) count as repeated after pi", to_pi);
    return fmt::format("; grid {}, phi_d over [0, 2 pi){}", grids.front().over_two_pi().text(),
                       repeated);
}

int info(const Options& options) {
    const auto [name, sources] = engine::list_databases(options.database.choice());
    print_line(
        fmt::format("{}: {} material{}", name, sources.size(), sources.size() == 1 ? "" : "s"));
    print_heading();
    std::size_t bad = 0;
    std::vector<Grid> grids;
    std::size_t damaged = 0;
    std::vector<std::string> names;  // of those that can be read, and their contents
    std::vector<std::string> hashes;
    Horizon horizon;
    {
        Progress progress("reading", options.quiet);
        for (std::size_t i = 0; i < sources.size(); ++i) {
            const auto& material = sources[i].material;
            try {
                const auto database = sources[i].open();
                const Grid& grid = database->grid();
                const Content content = content_of(*database, horizon.runs(grid),
                                                   share_of(progress, i, sources.size()));
                clear_progress();
                print_row(material, grid, content);
                damaged += content.fault.empty() ? 0 : 1;
                names.push_back(material);
                hashes.push_back(content.hash);
                grids.push_back(grid);
            } catch (const Error& error) {
                if (error.fault() != Fault::input) {
                    throw;
                }
                ++bad;
                clear_progress();
                print_line(fmt::format("{:<32} cannot be used: {}", material, error.what()));
            }
        }
    }
    print_line("");
    const auto copies = engine::copies_among(names, hashes);
    for (const auto& same : copies) {
        print_line(fmt::format("the same content: {}", fmt::join(same, ", ")));
    }
    if (damaged > 0) {
        print_line(fmt::format("{} of {} look{} damaged", damaged, sources.size(),
                               damaged == 1 ? "s" : ""));
    }
    print_line(fmt::format("{} of {} can be read{}", sources.size() - bad, sources.size(),
                           grid_text(grids)));
    return bad == 0 && damaged == 0 && copies.empty() && have_one_grid(grids) && !sources.empty()
               ? kSuccess
               : kInput;
}

/// Throws Error (usage) when a directory is where the database, or a part of it, is read from.
void refuse_source(const std::string& directory, const engine::Database& database) {
    std::vector<std::string> paths = {database.path()};
    std::ranges::transform(database.parts(), std::back_inserter(paths),
                           &engine::DatabasePart::path);
    std::error_code none;
    for (const auto& path : paths) {
        // That of a model is its name.
        if (std::filesystem::path(path).is_absolute() &&
            std::filesystem::equivalent(directory, path, none)) {
            throw Error(
                Fault::usage,
                fmt::format("{}: is the database that is read; write into another directory",
                            directory));
        }
    }
}

int write(const Options& options) {
    const auto database = open_database_and_warn(options.database);
    const auto& materials = database->materials();
    refuse_source(options.out, *database);
    std::vector<OutputFile> files;
    Progress progress("writing", options.quiet);
    for (std::size_t m = 0; m < materials.size(); ++m) {
        files.push_back(
            {.name = engine::file_stem(materials[m]) + ".binary", .write = [&, m](int file) {
                 scan::write_all(file, engine::merl_file(*database, m));
                 progress.update(static_cast<double>(m + 1) /
                                 static_cast<double>(materials.size()));
             }});
    }
    OutputDirectory out(options.out, options.force, std::move(files));
    out.finish();
    clear_progress();
    const auto range = database->grid().phi_d_range;
    if (engine::is_over_all_of_phi_d(database->grid()) != (range == engine::PhiDRange::two_pi)) {
        print_warning(fmt::format(
            "{}: the sizes of the grid, {}, do not say that phi_d ends at {}: whoever reads these "
            "files has to know it (--phi-d-range {})",
            options.out, database->grid().text(), engine::range_name(range),
            engine::range_name(range)));
    }
    if (!options.quiet) {
        print_line(fmt::format("{} materials of {} in {}", materials.size(), database->name(),
                               options.out));
    }
    return kSuccess;
}

/// What follows the value of an option here is an argument of the command.
void one_value_each(const std::vector<CLI::Option*>& options) {
    for (auto* option : options) {
        option->allow_extra_args(false);
    }
}

}  // namespace

void add_database(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command =
        program.add_subcommand("database", "What a database holds; a database as MERL files");
    command->require_subcommand(1);
    command->footer(
        "Examples:\n"
        "  merl-scan database info                          the built-in database\n"
        "  merl-scan database info ~/merl/brdfs             what is in it; names every bad file\n"
        "  merl-scan database info ~/merl mine=~/fits       of both: merl/NAME and mine/NAME\n"
        "  merl-scan database write /tmp/abc                the built-in database as files");

    auto* info_command = command->add_subcommand(
        "info", "Per material: samples, negative samples (not measured), range of values");
    info_command
        ->add_option("databases", options->database.databases,
                     fmt::format("[LABEL=]PATH or NAME: {}, or one file of it (default: built-in)",
                                 engine::database_help()))
        ->transform(not_empty());
    one_value_each(add_material_options(*info_command, options->database));
    add_quiet_option(*info_command, options->quiet, "No progress");
    info_command->footer(
        "Examples:\n"
        "  merl-scan database info ~/merl/brdfs\n"
        "  merl-scan database info ~/merl/brdfs/chrome.binary\n"
        "  merl-scan database info ~/rgl mine=~/fits --exclude '*fabric*'\n"
        "\n"
        "A file that cannot be used, that looks like a broken copy, or that has the content of\n"
        "another is named with the reason, the others are still listed, and the exit status is 3.");
    info_command->callback([&chosen, options] { chosen = [options] { return info(*options); }; });

    auto* write_command = command->add_subcommand(
        "write", "Write a database as MERL .binary files (the built-in one: 3.3 GiB)");
    write_command->add_option("directory", options->out, "The directory to make")
        ->transform(not_empty())
        ->required();
    one_value_each(add_database_options(*write_command, options->database));
    add_force_option(*write_command, options->force, "Replace the files of an existing directory");
    add_quiet_option(*write_command, options->quiet);
    write_command->footer(
        "Examples:\n"
        "  merl-scan database write /tmp/abc\n"
        "  merl-scan database write /tmp/rgl --database ~/rgl --grid 45x45x90\n"
        "  merl-scan scan --database /tmp/abc --out results");
    write_command->callback([&chosen, options] { chosen = [options] { return write(*options); }; });
}

}  // namespace merl::app
