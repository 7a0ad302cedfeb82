#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <span>
#include <system_error>

#include "app/commands.h"
#include "app/exit_status.h"
#include "app/options.h"
#include "app/output_directory.h"
#include "app/progress.h"
#include "app/terminal.h"
#include "engine/error.h"
#include "engine/reflectance/abc_database.h"
#include "engine/reflectance/merl_directory.h"
#include "engine/reflectance/merl_file.h"

namespace merl::app {
namespace {

using reflectance::Grid;
using reflectance::VoxelRange;

struct Options {
    std::string path;
    std::string out;
    bool force = false;
    bool quiet = false;
};

/// What `database info` says of one material.
struct Content {
    std::uint64_t negative = 0;
    double least = std::numeric_limits<double>::infinity();  // of the measured numbers
    double most = 0;
};

/// Goes through one material; `read` is Database::read or the same for a single file. `progress`
/// is called with the share of it that is done.
template <typename Read>
Content content_of(const Grid& grid, const Read& read,
                   const std::function<void(double)>& progress) {
    constexpr std::uint64_t kVoxelsAtATime = 65536;
    Content content;
    std::vector<double> samples;
    for (std::uint64_t at = 0; at < grid.voxels(); at += kVoxelsAtATime) {
        const VoxelRange range = {at, std::min(at + kVoxelsAtATime, grid.voxels())};
        samples.resize(3 * range.size());
        read(range, samples);
        for (std::uint64_t i = 0; i < range.size(); ++i) {
            bool negative = false;
            for (std::size_t plane = 0; plane < 3; ++plane) {
                const double value = samples[plane * range.size() + i];
                if (value < 0) {
                    negative = true;
                } else {
                    content.least = std::min(content.least, value);
                    content.most = std::max(content.most, value);
                }
            }
            content.negative += negative ? 1 : 0;
        }
        progress(static_cast<double>(range.last) / static_cast<double>(grid.voxels()));
    }
    return content;
}

void print_heading() {
    print_line("");
    print_line(fmt::format("{:<32} {:>12} {:>12}   {}", "material", "samples", "negative",
                           "values, 1/sr"));
}

void print_row(const std::string& material, const Grid& grid, const Content& content) {
    const auto values = content.negative == grid.voxels()
                            ? std::string("nothing was measured")
                            : fmt::format("{:.6g} to {:.6g}", content.least, content.most);
    print_line(fmt::format("{:<32} {:>12} {:>12}   {}", material, grid.voxels(), content.negative,
                           values));
}

/// Progress over several materials; call it with the share of one of them.
auto share_of(Progress& progress, std::size_t material, std::size_t count) {
    return [&progress, material, count](double share) {
        progress.update((static_cast<double>(material) + share) / static_cast<double>(count));
    };
}

int info_of_built_in(const Options& options) {
    const auto database = reflectance::make_abc_database();
    const auto& materials = database->materials();
    print_line(fmt::format("{}: {} materials, {}", database->name(), materials.size(),
                           database->grid().text()));
    print_heading();
    Progress progress("computing", options.quiet);
    for (std::size_t m = 0; m < materials.size(); ++m) {
        const Content content = content_of(
            database->grid(),
            [&](VoxelRange range, std::span<double> samples) { database->read(m, range, samples); },
            share_of(progress, m, materials.size()));
        clear_progress();
        print_row(materials[m], database->grid(), content);
    }
    return kSuccess;
}

int info(const Options& options) {
    if (options.path.empty()) {
        return info_of_built_in(options);
    }
    std::vector<reflectance::MerlEntry> entries;
    std::error_code none;
    if (std::filesystem::is_directory(options.path, none)) {
        entries = reflectance::list_merl_directory(options.path);
        print_line(fmt::format("{}: {} .binary file{}", options.path, entries.size(),
                               entries.size() == 1 ? "" : "s"));
    } else {
        reflectance::read_merl_header(options.path);  // throws unless it is a MERL file
        entries.push_back({std::filesystem::path(options.path).stem().string(), options.path});
        print_line(fmt::format("{}: one file", options.path));
    }
    print_heading();
    std::size_t bad = 0;
    Grid first_grid;
    bool any = false;
    bool grids_differ = false;
    {
        Progress progress("reading", options.quiet);
        for (std::size_t i = 0; i < entries.size(); ++i) {
            const auto& [material, path] = entries[i];
            try {
                const Grid grid = reflectance::read_merl_header(path);
                const auto read = [&path = path, &grid](VoxelRange range,
                                                        std::span<double> samples) {
                    reflectance::read_merl_samples(path, grid, range, samples, {});
                };
                const Content content =
                    content_of(grid, read, share_of(progress, i, entries.size()));
                clear_progress();
                print_row(material, grid, content);
                grids_differ |= any && grid != first_grid;
                first_grid = any ? first_grid : grid;
                any = true;
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
    print_line(fmt::format("{} of {} can be read{}", entries.size() - bad, entries.size(),
                           grids_differ ? "; their grids differ, and a scan needs one grid"
                           : any        ? fmt::format("; grid {}", first_grid.text())
                                        : ""));
    return bad == 0 && !grids_differ && !entries.empty() ? kSuccess : kInput;
}

int write(const Options& options) {
    const auto database = reflectance::make_abc_database();
    const auto& materials = database->materials();
    std::vector<std::string> files(materials.size());
    std::transform(materials.begin(), materials.end(), files.begin(),
                   [](const std::string& material) { return material + ".binary"; });
    OutputDirectory out(options.out, options.force, files);
    {
        Progress progress("writing", options.quiet);
        for (std::size_t m = 0; m < materials.size(); ++m) {
            try {
                reflectance::write_merl_file(out.path(files[m]), *database, m);
            } catch (const Error& error) {
                throw Error(error.fault(), out.with_target(error.what()));
            }
            progress.update(static_cast<double>(m + 1) / static_cast<double>(materials.size()));
        }
    }
    out.commit();
    if (!options.quiet) {
        print_line(fmt::format("{} materials of {} in {}", materials.size(), database->name(),
                               options.out),
                   kResultsAreThere);
    }
    return kSuccess;
}

}  // namespace

void add_database(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command =
        program.add_subcommand("database", "What a database holds; the built-in one as files");
    command->require_subcommand(1);

    auto* info_command = command->add_subcommand(
        "info", "Per material: samples, negative samples (not measured), range of values");
    info_command
        ->add_option("path", options->path,
                     "A directory of MERL .binary files, or one file (default: the built-in "
                     "database)")
        ->transform(not_empty());
    info_command->add_flag("--quiet", options->quiet, "No progress");
    info_command->footer(
        "Examples:\n"
        "  merl-scan database info ~/merl/brdfs\n"
        "  merl-scan database info ~/merl/brdfs/chrome.binary\n"
        "\n"
        "A file that cannot be used is named with the reason, the others are still\n"
        "listed, and the exit status is 3.");
    info_command->callback([&chosen, options] { chosen = [options] { return info(*options); }; });

    auto* write_command = command->add_subcommand(
        "write", "Write the built-in database as MERL .binary files (3.3 GiB)");
    write_command->add_option("directory", options->out, "The directory to make")
        ->transform(not_empty())
        ->required();
    write_command->add_flag("--force", options->force,
                            "Replace the files of an existing directory");
    write_command->add_flag("--quiet", options->quiet, "No progress and no summary");
    write_command->footer(
        "Examples:\n"
        "  merl-scan database write /tmp/abc\n"
        "  merl-scan scan --database /tmp/abc --out results");
    write_command->callback([&chosen, options] { chosen = [options] { return write(*options); }; });
}

}  // namespace merl::app
