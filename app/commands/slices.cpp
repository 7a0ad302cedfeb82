#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>

#include "app/cli/database_options.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/image_file.h"
#include "app/output/output_directory.h"
#include "app/output/provenance.h"
#include "engine/base/error.h"
#include "engine/base/text.h"
#include "engine/database/domain.h"

namespace merl::app {
namespace {

using engine::Domain;
using engine::Voxel;

constexpr std::uint32_t kPixels = 360;  // of every slice, in width and height
constexpr const char* kFigure = "figure-4.4.png";
constexpr std::uint32_t kMargin = 12;  // around the panels of figure 4.4

struct Options {
    std::string out;
    DatabaseOptions database;
    bool force = false;
    bool quiet = false;
};

/// A column of figure 4.4 of Ryman 2018, with the constant that keeps it within 0 and 1.
struct Column {
    const char* name;
    double (*value)(const Voxel&);
};

double projected_area(const Voxel& v) {
    return v.above_horizon() ? v.cos_theta_i * v.cos_theta_o : 0;
}

constexpr std::array<Column, 3> kColumns = {{
    {"projected-area", projected_area},
    {"0.05-s_merl", [](const Voxel& v) { return 0.05 * v.s_merl; }},
    {"0.4-projected-area-s_merl",
     [](const Voxel& v) { return 0.4 * projected_area(v) * v.s_merl; }},
}};

/// M_s to the right, M_t upwards, at one M_r.
pipeline::Image domain_slice(const Column& column, double m_r) {
    pipeline::Image image(kPixels, kPixels);
    for (std::uint32_t y = 0; y < kPixels; ++y) {
        for (std::uint32_t x = 0; x < kPixels; ++x) {
            const double m_s = (x + 0.5) / kPixels;
            const double m_t = 1 - (y + 0.5) / kPixels;
            image.at(x, y).fill(static_cast<float>(column.value(Domain::at(m_r, m_s, m_t))));
        }
    }
    return image;
}

template <typename Encode>
pipeline::Image encoded(const pipeline::Image& image, const Encode& encode) {
    pipeline::Image result = image;
    for (auto& pixel : result.pixels) {
        std::transform(pixel.begin(), pixel.end(), pixel.begin(), encode);
    }
    return result;
}

/// Writes NAME.exr with the values and NAME.png with what is to be seen.
void write_images(OutputDirectory& out, const std::string& name, const pipeline::Image& values,
                  const pipeline::Image& shown, const std::string& comment = {}) {
    out.write(name + ".exr", exr_file(values, comment));
    out.write(name + ".png", png_file(shown, comment));
}

/// The six panels of figure 4.4 on white, M_r = 0 above M_r = 0.5.
void write_figure(OutputDirectory& out, const std::function<void()>& progress) {
    pipeline::Image sheet(3 * kPixels + 4 * kMargin, 2 * kPixels + 3 * kMargin);
    std::fill(sheet.pixels.begin(), sheet.pixels.end(), std::array<float, 3>{1, 1, 1});
    for (std::uint32_t row = 0; row < 2; ++row) {
        for (std::uint32_t column = 0; column < kColumns.size(); ++column) {
            const pipeline::Image values = domain_slice(kColumns[column], row == 0 ? 0.0 : 0.5);
            const pipeline::Image shown = encoded(values, pipeline::lightness);
            const auto name =
                fmt::format("figure-4.4-{}-mr{}", kColumns[column].name, row == 0 ? "0" : "0.5");
            write_images(out, name, values, shown);
            progress();
            for (std::uint32_t y = 0; y < kPixels; ++y) {
                for (std::uint32_t x = 0; x < kPixels; ++x) {
                    sheet.at(kMargin + column * (kPixels + kMargin) + x,
                             kMargin + row * (kPixels + kMargin) + y) = shown.at(x, y);
                }
            }
        }
    }
    out.write(kFigure, png_file(sheet));
}

/// Red, green and blue by theta_d, at one theta_h and phi_d = 90 degrees; none negative.
using Layer = std::vector<std::array<double, 3>>;

Layer middle_layer(const engine::Database& database, std::size_t material, std::uint32_t t) {
    // 90 degrees is the middle of the range: on a voxel when their number is odd, else between two.
    const auto& grid = database.grid();
    const auto below_pi = grid.over_pi().phi_d;
    const std::uint64_t before = (below_pi - 1) / 2;
    const std::uint64_t after = below_pi / 2;
    constexpr std::uint64_t kVoxelsAtATime = 65536;  // that are read, or one row
    const std::uint64_t rows_at_a_time = std::max<std::uint64_t>(1, kVoxelsAtATime / grid.phi_d);
    Layer layer(grid.theta_d);
    std::vector<double> samples;
    for (std::uint64_t first = 0; first < layer.size(); first += rows_at_a_time) {
        const std::uint64_t rows = std::min(rows_at_a_time, layer.size() - first);
        const std::uint64_t size = rows * grid.phi_d;
        const std::uint64_t from = (first + std::uint64_t{grid.theta_d} * t) * grid.phi_d;
        samples.resize(3 * size);
        database.read(material, {from, from + size}, samples);
        for (std::uint64_t row = 0; row < rows; ++row) {
            for (std::size_t plane = 0; plane < 3; ++plane) {
                const double* const at = &samples[plane * size + row * grid.phi_d];
                layer[first + row][plane] =
                    (std::max(0.0, at[before]) + std::max(0.0, at[after])) / 2;
            }
        }
    }
    return layer;
}

/// The BRDF image slice of a material (Burley 2012): phi_d = 90 degrees, theta_h to the right and
/// theta_d upwards, both from 0 to 90 degrees, linear in the angle. Values in 1/sr, interpolated.
pipeline::Image material_slice(const engine::Database& database, std::size_t material) {
    const auto& grid = database.grid();
    const auto place = [](double m, std::uint32_t count) {  // between which voxel centres
        const double at = std::clamp(m * count - 0.5, 0.0, static_cast<double>(count - 1));
        const auto low = static_cast<std::uint32_t>(at);
        return std::tuple(low, std::min(low + 1, count - 1), at - low);
    };
    // A column of the image needs two layers of theta_h, which its neighbours often share.
    std::map<std::uint32_t, Layer> layers;
    const auto layer = [&](std::uint32_t t) -> const Layer& {
        const auto found = layers.find(t);
        return found != layers.end()
                   ? found->second
                   : layers.emplace(t, middle_layer(database, material, t)).first->second;
    };
    pipeline::Image image(kPixels, kPixels);
    for (std::uint32_t x = 0; x < kPixels; ++x) {
        const auto [t0, t1, t] = place(std::sqrt((x + 0.5) / kPixels), grid.theta_h);
        layers.erase(layers.begin(), layers.lower_bound(t0));
        const auto& below = layer(t0);
        const auto& above = layer(t1);
        for (std::uint32_t y = 0; y < kPixels; ++y) {
            const auto [s0, s1, s] = place(1 - (y + 0.5) / kPixels, grid.theta_d);
            for (std::size_t plane = 0; plane < 3; ++plane) {
                image.at(x, y)[plane] = static_cast<float>(
                    (1 - t) * ((1 - s) * below[s0][plane] + s * below[s1][plane]) +
                    t * ((1 - s) * above[s0][plane] + s * above[s1][plane]));
            }
        }
    }
    return image;
}

int run(const Options& options) {
    const auto database = open_database_and_warn(options.database);
    const auto& names = database->materials();
    const std::size_t materials = options.database.materials.is_all() ? 0 : names.size();
    const auto file_name = [&](std::size_t material) {
        return "material-" + engine::file_stem(names[material]);
    };
    std::vector<OutputFile> owned;
    const auto own = [&](const std::string& name) {
        owned.push_back({.name = name + ".exr"});
        owned.push_back({.name = name + ".png"});
    };
    for (const auto& column : kColumns) {
        own(fmt::format("figure-4.4-{}-mr0", column.name));
        own(fmt::format("figure-4.4-{}-mr0.5", column.name));
    }
    for (std::size_t material = 0; material < materials; ++material) {
        own(file_name(material));
    }
    owned.push_back({.name = kFigure});
    OutputDirectory out(options.out, options.force, owned);
    {
        Progress progress("drawing", options.quiet);
        std::size_t done = 0;
        const auto step = [&] {
            progress.update(static_cast<double>(++done) /
                            static_cast<double>(2 * kColumns.size() + materials));
        };
        write_figure(out, step);
        for (std::size_t material = 0; material < materials; ++material) {
            const pipeline::Image slice = material_slice(*database, material);
            // A perfect white diffuser, 1/pi, is shown as white; highlights are cut off.
            const pipeline::Image shown = encoded(
                slice, [](float f) { return pipeline::srgb(f * std::numbers::pi_v<float>); });
            write_images(out, file_name(material), slice, shown,
                         as_utf8(fmt::format("{} of {}", names[material],
                                             source_text(*database, material))));
            step();
        }
    }
    out.finish();
    if (!options.quiet) {
        const auto source =
            materials == 0 ? std::string() : "; materials of " + database_text(*database);
        print_line(fmt::format("{} images in {}{}", owned.size(), options.out, source));
    }
    return kSuccess;
}

}  // namespace

void add_slices(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "slices", "Images of the projected area weight and of s_MERL, and of materials");
    command->add_option("--out", options->out, "The directory to make")
        ->transform(not_empty())
        ->required();
    add_database_options(*command, options->database);
    add_force_option(*command, options->force, "Replace the images in an existing directory");
    add_quiet_option(*command, options->quiet);
    command->footer(
        "Draws figure 4.4 of Ryman 2018: projected area, 0.05 s_MERL, and 0.4 times their\n"
        "product, at M_r = 0 and 0.5, M_s to the right and M_t upwards. For each material that\n"
        "--materials or --exclude chooses, its slice at phi_d = 90 degrees, theta_h to the right\n"
        "and theta_d upwards. OpenEXR has the values, PNG is for looking.\n"
        "\n"
        "Examples:\n"
        "  merl-scan slices --out slices\n"
        "  merl-scan slices --out slices --materials chrome,blue-fabric --force\n"
        "  merl-scan slices --out slices --database ~/merl --materials 'gold-*'");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
