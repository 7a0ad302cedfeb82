#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <limits>
#include <memory>

#include "app/commands.h"
#include "app/exit_status.h"
#include "app/output_directory.h"
#include "app/progress.h"
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

/// Goes through one material; `read` is Database::read or the same for a single file.
template <typename Read>
Content content_of(const Grid& grid, const Read& read) {
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
    }
    return content;
}

void print_row(const std::string& material, const Grid& grid, const Content& content) {
    if (content.negative == grid.voxels()) {
        fmt::print("{:<32} {:>12} {:>12}   nothing was measured\n", material, grid.voxels(),
                   content.negative);
    } else {
        fmt::print("{:<32} {:>12} {:>12}   {:.6g} to {:.6g}\n", material, grid.voxels(),
                   content.negative, content.least, content.most);
    }
}

constexpr const char* kHeading = "{:<32} {:>12} {:>12}   {}\n";

int info_of_built_in() {
    const auto database = reflectance::make_abc_database();
    fmt::print("{}: {} materials, {}\n\n", database->name(), database->materials().size(),
               database->grid().text());
    fmt::print(kHeading, "material", "samples", "negative", "values, 1/sr");
    for (std::size_t m = 0; m < database->materials().size(); ++m) {
        print_row(database->materials()[m], database->grid(),
                  content_of(database->grid(), [&](VoxelRange range, std::span<double> samples) {
                      database->read(m, range, samples);
                  }));
    }
    return kSuccess;
}

int info(const Options& options) {
    if (options.path.empty()) {
        return info_of_built_in();
    }
    std::vector<reflectance::MerlEntry> entries;
    if (std::filesystem::is_directory(options.path)) {
        entries = reflectance::list_merl_directory(options.path);
    } else {
        entries.push_back({std::filesystem::path(options.path).stem().string(), options.path});
    }
    fmt::print("{}: {} .binary file{}\n\n", options.path, entries.size(),
               entries.size() == 1 ? "" : "s");
    fmt::print(kHeading, "material", "samples", "negative", "values, 1/sr");
    std::size_t bad = 0;
    Grid first_grid;
    bool any = false;
    bool grids_differ = false;
    Progress progress("reading", options.quiet);
    for (std::size_t i = 0; i < entries.size(); ++i) {
        try {
            const auto& path = entries[i].path;
            const Grid grid = reflectance::read_merl_header(path);
            print_row(entries[i].material, grid,
                      content_of(grid, [&](VoxelRange range, std::span<double> samples) {
                          reflectance::read_merl_samples(path, grid, range, samples, {});
                      }));
            grids_differ |= any && grid != first_grid;
            first_grid = any ? first_grid : grid;
            any = true;
        } catch (const Error& error) {
            ++bad;
            fmt::print("{:<32} cannot be used: {}\n", entries[i].material, error.what());
        }
        progress.update(static_cast<double>(i + 1) / static_cast<double>(entries.size()));
    }
    fmt::print("\n{} of {} can be read", entries.size() - bad, entries.size());
    if (grids_differ) {
        fmt::print("; their grids differ, and a scan needs one grid");
    } else if (any) {
        fmt::print("; grid {}", first_grid.text());
    }
    fmt::print("\n");
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
            reflectance::write_merl_file(out.path(files[m]), *database, m);
            progress.update(static_cast<double>(m + 1) / static_cast<double>(materials.size()));
        }
    }
    out.commit();
    if (!options.quiet) {
        fmt::print("{} materials of {} in {}\n", materials.size(), database->name(), options.out);
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
    info_command->add_option(
        "path", options->path,
        "A directory of MERL .binary files, or one file (default: the built-in "
        "database)");
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
    write_command->add_option("directory", options->out, "The directory to make")->required();
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
