#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <memory>
#include <numeric>

#include "app/choose_materials.h"
#include "app/commands.h"
#include "app/contact_page.h"
#include "app/describe.h"
#include "app/exit_status.h"
#include "app/options.h"
#include "app/output_directory.h"
#include "app/progress.h"
#include "app/sphere_image.h"
#include "app/stopwatch.h"
#include "app/terminal.h"
#include "engine/error.h"
#include "scan/csv.h"

namespace merl::app {
namespace {

constexpr std::uint32_t kThumbnail = 128;  // pixels of a sphere on the contact sheet, at most
constexpr const char* kSheet = "contact-sheet.png";
constexpr const char* kPage = "contact-sheet.html";

struct Options {
    std::string out = "merl-scan-spheres";
    std::string database;
    std::vector<std::string> materials;
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
    Names(const reflectance::Database& database, const std::vector<std::size_t>& materials,
          const Target& target, std::size_t lights)
        : database_(database), materials_(materials), target_(target), lights_(lights) {}

    std::string name(std::size_t material, std::size_t light) const {
        const auto& stem =
            target_.stem.empty() ? database_.materials()[materials_[material]] : target_.stem;
        return lights_ == 1 ? stem : fmt::format("{}-light-{}", stem, light + 1);
    }

    /// All of them, those of the first light first.
    std::vector<std::string> in_order() const {
        std::vector<std::string> list;
        for (std::size_t light = 0; light < lights_; ++light) {
            for (std::size_t material = 0; material < materials_.size(); ++material) {
                list.push_back(name(material, light));
            }
        }
        return list;
    }

    std::vector<std::string> files() const {
        std::vector<std::string> files;
        for (const auto& name : in_order()) {
            files.push_back(name + target_.exr);
            files.push_back(name + target_.png);
        }
        if (target_.stem.empty()) {
            files.emplace_back(kSheet);
            files.emplace_back(kPage);
        }
        std::vector<std::string> sorted = files;
        std::ranges::sort(sorted);
        const auto twice = std::ranges::adjacent_find(sorted);
        if (twice != sorted.end()) {
            throw Error(Fault::usage,
                        fmt::format("two images would be called \"{}\"; render the materials "
                                    "into directories of their own",
                                    *twice));
        }
        return files;
    }

  private:
    const reflectance::Database& database_;
    const std::vector<std::size_t>& materials_;
    const Target& target_;
    std::size_t lights_;
};

/// All spheres side by side, as displayed, each made smaller by averaging linear light.
class ContactSheet {
  public:
    ContactSheet(std::size_t spheres, std::uint32_t size)
        : factor_((size + kThumbnail - 1) / kThumbnail),
          side_(size / factor_),
          columns_(static_cast<std::uint32_t>(std::ceil(std::sqrt(static_cast<double>(spheres))))),
          sheet_(columns_ * side_,
                 (static_cast<std::uint32_t>(spheres) + columns_ - 1) / columns_ * side_) {}

    void put(std::size_t number, const Image& linear) {
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

    const Image& image() const { return sheet_; }

  private:
    std::uint32_t factor_;
    std::uint32_t side_;
    std::uint32_t columns_;
    Image sheet_;
};

std::vector<std::size_t> chosen_materials(const reflectance::Database& database,
                                          const std::vector<std::string>& values) {
    if (!values.empty()) {
        return find_materials(database, values);
    }
    std::vector<std::size_t> all(database.materials().size());
    std::iota(all.begin(), all.end(), std::size_t{0});
    return all;
}

int run(const Options& options) {
    const auto database = open_database(options.database);
    const auto materials = chosen_materials(*database, options.materials);
    const std::size_t lights = options.image.lights.size();
    const Target target = target_of(options, materials.size());
    const Names names(*database, materials, target, lights);
    const auto files = names.files();
    auto out = target.stem.empty()
                   ? OutputDirectory(target.directory, options.force, files)
                   : OutputDirectory::for_files(target.directory, options.force, files);
    ContactSheet sheet(materials.size() * lights, options.image.size);
    const auto write = [&](const std::string& file, const std::string& bytes) {
        out.write(file, [&](int descriptor) { scan::write_all(descriptor, bytes); });
    };
    Stopwatch watch;
    std::string device;
    {
        Progress progress("rendering", options.quiet);
        device = render_sphere_images(
            *database, materials, options.image,
            [&](std::size_t material, std::size_t light, const Image& linear) {
                const auto name = names.name(material, light);
                const auto comment = as_utf8(fmt::format(
                    "{} of {}, {}; light from {}", database->materials()[materials[material]],
                    database->name(), database->kind(), options.image.lights[light]));
                write(name + target.exr, exr_file(linear, comment));
                write(name + target.png, png_file(displayed(linear, options.image), comment));
                sheet.put(light * materials.size() + material, linear);
            },
            [&](double share) { progress.update(share); });
    }
    if (target.stem.empty()) {
        const auto title =
            as_utf8(fmt::format("{} of {}, {}", counted(materials.size(), "material"),
                                database->name(), database->kind()));
        write(kSheet, png_file(displayed(sheet.image(), options.image), title));
        write(kPage, contact_page(title, names.in_order()));
    }
    out.commit();
    if (!options.quiet) {
        print_line(fmt::format("{} of {}, {}", counted(materials.size() * lights, "sphere"),
                               database->name(), database->kind()));
        print_line(
            fmt::format("{:.2f} seconds on {}; {}", watch.lap(), device,
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
    command
        ->add_option("--database", options->database,
                     "A directory of MERL .binary files (default: the built-in stand-in database)")
        ->transform(not_empty());
    command->add_option("--material", options->materials,
                        "A material, or names with commas between them, or the option more than "
                        "once (default: all)");
    add_sphere_options(*command, options->image);
    command->add_flag("--force", options->force, "Replace images that exist");
    command->add_flag("--quiet", options->quiet, "No progress and no summary");
    command->footer(
        "A unit sphere under one directional white light and a perspective camera, as in the "
        "judge\n"
        "experiment of Ryman 2018 (docs/experiment.md). OpenEXR has linear light, PNG is as "
        "displayed.\n"
        "\n"
        "Examples:\n"
        "  merl-scan render --material gold-paint --out gold.exr      gold.png beside it\n"
        "  merl-scan render --out spheres                             all materials\n"
        "  merl-scan render --light 1,1,1 --light -1,1,-0.5 --background 0 --out spheres");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
