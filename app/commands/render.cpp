#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/control.h"
#include "app/cli/database_options.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/sphere_options.h"
#include "app/cli/terminal.h"
#include "app/cli/tried_device.h"
#include "app/commands/commands.h"
#include "app/output/image_file.h"
#include "app/output/json.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "app/output/scan_record.h"
#include "app/pages/contact_page.h"
#include "app/pipeline/spheres.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/stopwatch.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/select/selection_file.h"

namespace merl::app {
namespace {

constexpr std::uint32_t kThumbnail = 128;  // pixels of a sphere on the contact sheet, at most
constexpr const char* kSheet = "contact-sheet.png";
constexpr const char* kPage = "contact-sheet.html";

struct Options {
    std::string out = "merl-scan-spheres";
    DatabaseOptions database;
    std::string selection;
    SphereImageOptions image;
    bool force = false;
    bool quiet = false;
};

/// Where images go: a directory with the files of every material, or for `--out FILE.exr` or
/// `--out FILE.png` the directory of that file.
struct Target {
    std::filesystem::path directory;
    std::string stem = {};  // of the only material; empty: each is called as it is
    std::string exr = ".exr";
    std::string png = ".png";  // the one that was asked for as it was written
    std::string beside = {};   // what the other one is
};

Target target_of(const Options& options, std::size_t materials) {
    const std::filesystem::path out = options.out;
    const std::string extension = out.extension().string();
    std::string lower = extension;
    std::ranges::transform(lower, lower.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    const bool exr = lower == ".exr";
    const bool png = lower == ".png";
    if (!exr && !png) {
        return {.directory = out};
    }
    if (materials != 1) {
        throw Error(Fault::usage,
                    fmt::format("--out {}: a file is for one material, found {}; name a directory, "
                                "or one with --material",
                                options.out, materials));
    }
    return {.directory = out.has_parent_path() ? out.parent_path() : ".",
            .stem = out.stem().string(),
            .exr = exr ? extension : ".exr",
            .png = png ? extension : ".png",
            .beside = exr ? "PNG" : "OpenEXR"};
}

/// Names without extension: of each material, of each light.
class Names {
  public:
    Names(const engine::Database& database, const std::vector<std::size_t>& materials,
          const Target& target, std::size_t lights)
        : database_(database), materials_(materials), target_(target), lights_(lights) {}

    std::string name(std::size_t material, std::size_t light) const {
        return with_light(target_.stem.empty()
                              ? engine::file_stem(database_.materials()[materials_[material]])
                              : target_.stem,
                          light);
    }

    /// All of them, those of the first light first.
    std::vector<ContactImage> in_order() const {
        std::vector<ContactImage> list;
        for (std::size_t light = 0; light < lights_; ++light) {
            for (std::size_t material = 0; material < materials_.size(); ++material) {
                list.push_back({name(material, light),
                                with_light(database_.materials()[materials_[material]], light)});
            }
        }
        return list;
    }

    /// What is written of all of them.
    std::vector<OutputFile> files() const {
        std::vector<OutputFile> files;
        std::set<std::string> names;
        if (target_.stem.empty()) {
            names.insert(kSheet);
        }
        for (const auto& image : in_order()) {
            for (const auto& file : {image.file + target_.exr, image.file + target_.png}) {
                if (!names.insert(file).second) {
                    throw Error(Fault::usage,
                                fmt::format("two images would be called \"{}\"; render the "
                                            "materials into directories of their own",
                                            file));
                }
                files.push_back({.name = file});
            }
        }
        return files;
    }

  private:
    std::string with_light(const std::string& name, std::size_t light) const {
        return lights_ == 1 ? name : fmt::format("{}-light-{}", name, light + 1);
    }

    const engine::Database& database_;
    const std::vector<std::size_t>& materials_;
    const Target& target_;
    std::size_t lights_;
};

/// Pixels of a sphere on the contact sheet: fewer where there are a thousand spheres or more.
std::uint32_t thumbnail(std::size_t spheres) {
    constexpr double kPixels = 1U << 24U;  // of the sheet, which takes thirty bytes each
    const double side = std::sqrt(kPixels / static_cast<double>(spheres));
    return static_cast<std::uint32_t>(std::clamp(side, 1.0, double{kThumbnail}));
}

/// All spheres side by side, as displayed, each made smaller by averaging linear light.
class ContactSheet {
  public:
    ContactSheet(std::size_t spheres, std::uint32_t size)
        : factor_((size + thumbnail(spheres) - 1) / thumbnail(spheres)),
          side_(size / factor_),
          columns_(static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(spheres))))),
          sheet_(columns_ * side_,
                 (static_cast<std::uint32_t>(spheres) + columns_ - 1) / columns_ * side_) {}

    void put(std::size_t number, const pipeline::Image& linear) {
        const auto left = static_cast<std::uint32_t>(number % columns_) * side_;
        const auto top = static_cast<std::uint32_t>(number / columns_) * side_;
        for (std::uint32_t y = 0; y < side_; ++y) {
            for (std::uint32_t x = 0; x < side_; ++x) {
                auto& to = sheet_.at(left + x, top + y);
                for (std::uint32_t i = 0; i < factor_ * factor_; ++i) {
                    const auto& from =
                        linear.at(x * factor_ + i % factor_, y * factor_ + i / factor_);
                    for (std::size_t c = 0; c < to.size(); ++c) {
                        to[c] += from[c] / static_cast<float>(factor_ * factor_);
                    }
                }
            }
        }
    }

    const pipeline::Image& image() const { return sheet_; }

  private:
    std::uint32_t factor_;
    std::uint32_t side_;
    std::uint32_t columns_;
    pipeline::Image sheet_;
};

/// What is rendered: the database of a scan, or any other.
class Source {
  public:
    explicit Source(const Options& options) {
        if (options.selection.empty()) {
            any_ = open_database_and_warn(options.database);
            return;
        }
        const std::string text = scan::read_input(options.selection);
        const auto selection = scan::parse_selection(text, options.selection);
        scanned_.emplace(
            find_scan_record(options.selection, "selection.csv", hash_of(text), &selection),
            options.selection, options.database, options.quiet);
        std::ranges::for_each(scanned_->warnings(), print_warning);
        if (options.database.materials.is_all()) {
            for (const auto& configuration : selection.configurations) {
                selected_.insert(configuration.materials.begin(), configuration.materials.end());
            }
        }
    }

    const engine::Database& database() const { return any_ ? *any_ : scanned_->database(); }

    /// Indices of the materials to render: those that the options choose, of the selection, or all.
    std::vector<std::size_t> materials() const {
        const auto& names = database().materials();
        std::vector<std::size_t> chosen;
        for (std::size_t m = 0; m < names.size(); ++m) {
            if (selected_.empty() || selected_.contains(names[m])) {
                chosen.push_back(m);
            }
        }
        for (const auto& name : selected_) {
            if (std::ranges::find(names, name) == names.end()) {
                throw InputError(
                    fmt::format("the selection has a material \"{}\", which {} has not; --database "
                                "names the database of the scan",
                                name, database().name()));
            }
        }
        return chosen;
    }

    /// Throws unless the samples of a material are those of the scan, if there was one.
    void check(std::size_t material, const std::string& content_hash) const {
        if (scanned_) {
            scanned_->check(material, content_hash);
        }
    }

  private:
    std::set<std::string> selected_;  // empty: all of the database
    std::unique_ptr<engine::Database> any_;
    std::optional<ScannedDatabase> scanned_;
};

int run(const Options& options) {
    const Source source(options);
    const auto& database = source.database();
    const auto materials = source.materials();
    const auto view = options.image.complete_view();
    const std::size_t lights = options.image.lights.size();
    const Target target = target_of(options, materials.size());
    const Names names(database, materials, target, lights);
    ContactSheet sheet(materials.size() * lights, view.sphere.size);
    const auto title = as_utf8(fmt::format(
        "{} of {}{}", counted(materials.size(), "material"), database_text(database),
        database.skipped().empty() ? "" : "; left out: " + skipped_text(database.skipped())));
    auto files = names.files();
    if (target.stem.empty()) {
        files.push_back({.name = kSheet, .write = [&](int file) {
                             scan::write_all(
                                 file, png_file(pipeline::displayed(sheet.image(), view), title));
                         }});
        files.push_back({.name = kPage, .write = [&](int file) {
                             scan::write_all(file, contact_page(title, names.in_order()));
                         }});
    }
    auto out = target.stem.empty()
                   ? OutputDirectory(target.directory, options.force, std::move(files))
                   : OutputDirectory::for_files(target.directory, options.force, std::move(files));
    TerminalControl terminal(options.quiet);
    Stopwatch watch;
    std::uint64_t clipped = 0;
    std::pair<double, std::string> most = {0, ""};
    const auto context = tried_device(options.image.device, terminal.control());
    const auto device = pipeline::render_spheres(
        database, materials, view, context,
        [&](const engine::SphereImage& sphere, const pipeline::Image& linear) {
            const auto material = materials[sphere.material];
            source.check(material, sphere.content_hash);
            const auto name = names.name(sphere.material, sphere.light);
            const auto comment = with_content_hash(
                as_utf8(fmt::format("{} of {}; light from {}", database.materials()[material],
                                    source_text(database, material),
                                    options.image.lights[sphere.light])),
                sphere.content_hash);
            const double share = pipeline::clipped_share(sphere.pixels, view.exposure);
            clipped += share > 0 ? 1 : 0;
            most = std::max(most, {share, name});
            out.write(name + target.exr, exr_file(linear, comment));
            out.write(name + target.png, png_file(pipeline::displayed(linear, view), comment));
            sheet.put(sphere.light * materials.size() + sphere.material, linear);
        },
        terminal.control());
    out.finish();
    terminal.clear();
    if (!options.quiet) {
        print_line(fmt::format("{} of {}", counted(materials.size() * lights, "sphere"),
                               database_text(database)));
        print_line(clipped_text(clipped, materials.size() * lights, most.first, most.second));
        print_line(
            fmt::format("{:.2f} seconds on {}; {}", watch.lap(), device_text(device),
                        target.stem.empty()
                            ? fmt::format("{}: open {} in a browser", options.out, kPage)
                            : fmt::format("{} and the {} beside it", options.out, target.beside)));
    }
    return kSuccess;
}

}  // namespace

void add_render(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "render", "Spheres of materials as people see them: OpenEXR, PNG and a contact sheet");
    command
        ->add_option("--out", options->out,
                     "The directory to make, or for one material a file that ends in .exr or .png: "
                     "both are written")
        ->transform(not_empty())
        ->capture_default_str();
    add_database_options(*command, options->database,
                         "(default: built-in; with --selection what was scanned)");
    add_selection_option(*command, options->selection,
                         "of a scan: its materials, as they were scanned");
    add_sphere_options(*command, options->image);
    add_force_option(*command, options->force, "Replace images that exist");
    add_quiet_option(*command, options->quiet);
    command->footer(
        "A unit sphere under one directional white light and a perspective camera, as in the "
        "judge\n"
        "experiment of Ryman 2018 (docs/experiment.md). OpenEXR has linear light, PNG is as "
        "displayed.\n"
        "\n"
        "Examples:\n"
        "  merl-scan render --materials gold-paint --out gold.exr     gold.png beside it\n"
        "  merl-scan render --out spheres                             all materials\n"
        "  merl-scan render --database ~/merl --database mine=~/fits --materials '*/gold-*'\n"
        "  merl-scan render --selection results/selection.csv --out spheres\n"
        "  merl-scan render --light 1,1,1 --light -1,1,-0.5 --background 0 --out spheres");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
