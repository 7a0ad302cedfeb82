#include "engine/database/model_database.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>

#include "engine/base/csv_reader.h"
#include "engine/base/error.h"
#include "engine/base/number.h"
#include "engine/database/content_hash.h"
#include "engine/database/model.h"
#include "engine/database/open_database.h"
#include "engine/device/shader_compiler.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::expect_refused;
using test::hash_of_database;

using std::numbers::pi;

constexpr Grid kGrid = {.theta_h = 7, .theta_d = 5, .phi_d = 300};

std::vector<double> samples_of(const Database& database, std::size_t material) {
    const auto voxels = database.grid().voxels();
    std::vector<double> samples(3 * voxels);
    database.read(material, {0, voxels}, samples);
    return samples;
}

const std::string kWard =
    "material,diffuse_red,diffuse_green,diffuse_blue,specular_red,specular_green,specular_blue,"
    "roughness\n";

std::unique_ptr<Database> ward_of(const std::string& table) {
    return make_model_database(*find_model("ward"), table, "mine.csv", kGrid);
}

TEST(Model, ThereAreFive) {
    std::string names;
    for (const auto& model : models()) {
        names += model.name + " ";
        const auto database = open_model(model.name, {.theta_h = 2, .theta_d = 2, .phi_d = 2});
        EXPECT_EQ(database->kind(), built_in_kind);
        EXPECT_EQ(database->name(), model.header.database);
        EXPECT_EQ(open_database(database->path())->materials(), database->materials());
        const auto names_of_merl = merl_materials();
        EXPECT_TRUE(std::ranges::includes(names_of_merl, database->materials())) << model.name;
        EXPECT_GE(database->materials().size(), 86U);
    }
    EXPECT_EQ(names, "abc blinn-phong lafortune sgd ward ");
}

/// Files of models are GLSL, which the C++ compiler alone would not say.
TEST(Model, FilesAreGlsl) {
    for (const auto& model : models()) {
        std::string text =
            "layout(local_size_x = 1) in;\nconst float pi = 3.14159265;\n"
            "struct Voxel { float theta_h; float theta_d; float phi_d; float cos_theta_i; float "
            "cos_theta_o; };\n";
        for (const auto& p : model.header.parameters) {
            text += (p.is_rgb ? "const vec3 " + p.name + " = vec3(0.5);\n"
                              : "const float " + p.name + " = 1.5;\n");
        }
        text += model.source + "\nvoid main() {}\n";
        EXPECT_NO_THROW(device::compile_shader(
            {model.name, text}, "", [](std::string_view, std::string_view) { return nullptr; }))
            << model.name;
    }
}

/// Independent float64 evaluations of the four models that are not ABC (tests/data/README.md).
TEST(ModelDatabase, HasTheGoldenSamples) {
    std::ifstream file(MERL_MODEL_GOLDEN_CSV);
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    CsvReader reader(text, "golden");
    reader.header();
    std::map<std::string, std::unique_ptr<Database>> databases;
    std::size_t rows = 0;
    for (std::vector<std::string> fields; reader.next(fields); ++rows) {
        auto& database = databases[fields[0]];
        if (!database) {
            database = open_model(fields[0]);
        }
        const auto number = [&](std::size_t i) {
            return parse_number<std::uint64_t>(fields[i]).value();
        };
        const auto material = std::ranges::find(database->materials(), fields[1]);
        ASSERT_NE(material, database->materials().end()) << fields[1];
        const auto voxel = number(4) + 180 * (number(3) + 90 * number(2));
        std::array<double, 3> found = {};
        database->read(static_cast<std::size_t>(material - database->materials().begin()),
                       {voxel, voxel + 1}, found);
        for (std::size_t c = 0; c < 3; ++c) {
            const double expected = parse_finite(fields[5 + c]).value();
            EXPECT_NEAR(found[c], expected, 1e-9 * expected)
                << "line " << reader.line() << ", channel " << c;
        }
    }
    EXPECT_EQ(databases.size(), 4U);
    EXPECT_EQ(rows, 800U);
}

TEST(ModelDatabase, AbcIsTheFormulaOfTheSpecification) {
    // kd = 0.3, A = 7, B = 1000, C = 1.5, ior = 1.4 on a small grid, by the plain formula of Löw
    // et al. 2012.
    const Grid grid = {.theta_h = 5, .theta_d = 4, .phi_d = 6};
    const auto database = make_model_database(
        *find_model("abc"),
        "material,kd_red,kd_green,kd_blue,A_red,A_green,A_blue,B,C,ior\nm,0.1,0.2,0.3,5,6,7,1000,"
        "1.5,1.4\n",
        "one", grid);
    const auto samples = samples_of(*database, 0);
    const Domain domain(grid);
    for (std::uint64_t i = 0; i < grid.voxels(); ++i) {
        const Voxel v = domain.voxel(i);
        const double value = samples[2 * grid.voxels() + i];
        if (!v.above_horizon()) {
            EXPECT_EQ(value, 0);
            continue;
        }
        const double c = std::cos(v.theta_d);
        const double g = std::sqrt(1.4 * 1.4 + c * c - 1);
        const double f = 0.5 * std::pow((g - c) / (g + c), 2) *
                         (1 + std::pow((c * (g + c) - 1) / (c * (g - c) + 1), 2));
        const double masking = std::min(1.0, std::min(2 * std::cos(v.theta_h) * v.cos_theta_i / c,
                                                      2 * std::cos(v.theta_h) * v.cos_theta_o / c));
        const double expected = 0.3 / pi + f * masking * 7 /
                                               std::pow(1 + 1000 * (1 - std::cos(v.theta_h)), 1.5) /
                                               (pi * v.cos_theta_i * v.cos_theta_o);
        EXPECT_NEAR(value / expected, 1, 1e-13);
    }
}

TEST(ModelDatabase, SamplesDoNotDependOnTheRange) {
    for (const auto& model : models()) {
        const auto database = open_model(model.name, kGrid);
        const auto voxels = kGrid.voxels();
        const auto whole = samples_of(*database, 3);
        for (std::uint64_t first = 0, step = 1; first < voxels; first += step, step += 97) {
            const VoxelRange range = {first, std::min(first + step, voxels)};
            std::vector<double> part(3 * range.size());
            database->read(3, range, part);
            for (std::size_t plane = 0; plane < 3; ++plane) {
                for (std::uint64_t i = 0; i < range.size(); ++i) {
                    ASSERT_EQ(part[plane * range.size() + i], whole[plane * voxels + first + i])
                        << model.name;
                }
            }
        }
    }
}

TEST(ModelDatabase, KeepsSamplesWhereTheyTakeTime) {
    const auto sgd = open_model("sgd", kGrid);
    const auto before = samples_of(*sgd, 3);
    EXPECT_GT(sgd->keep(1'000'000), 0U);
    EXPECT_EQ(samples_of(*sgd, 3), before);
    EXPECT_EQ(samples_of(*sgd, 3), before);
    EXPECT_EQ(open_model("abc", kGrid)->keep(1'000'000), 0U);
}

TEST(ModelDatabase, ColumnsAndRowsInAnyOrderAreTheSameContent) {
    const auto a = ward_of(kWard + "b,0.1,0.2,0.3,0.4,0.5,0.6,0.2\na,0.1,0.1,0.1,0,0,0,0.5\n");
    const auto b = ward_of(
        "\xef\xbb\xbfroughness,\"material\",specular_blue,specular_green,specular_red,diffuse_blue,"
        "diffuse_green,diffuse_red\r\n0.5,\"a\",0,0,0,0.1,0.1,0.1\r\n\r\n0.2,b,0.6,0.5,0.4,0.3,0.2,"
        "0.1");
    EXPECT_EQ(a->materials(), (std::vector<std::string>{"a", "b"}));
    EXPECT_EQ(b->materials(), a->materials());
    for (std::size_t m = 0; m < 2; ++m) {
        EXPECT_EQ(samples_of(*a, m), samples_of(*b, m));
    }
    EXPECT_EQ(hash_of_database(*a), hash_of_database(*b));
    auto german = kWard + "b,0.1,0.2,0.3,0.4,0.5,0.6,0.2\na,0.1,0.1,0.1,0,0,0,0.5\n";
    std::ranges::replace(german, ',', ';');
    std::ranges::replace(german, '.', ',');
    EXPECT_EQ(hash_of_database(*ward_of(german)), hash_of_database(*a));
    EXPECT_NEAR(samples_of(*a, 0)[0], 0.1 / pi, 1e-15);
}

TEST(ModelDatabase, TheHashTellsModelsAndFiguresApart) {
    const std::string row = "m,0.1,0.2,0.3,0.4,0.5,0.6,";
    const auto hash = [&](const char* model, const char* last, const std::string& figure) {
        auto header = kWard;
        header.replace(header.find("roughness"), 9, last);
        return hash_of_database(
            *make_model_database(*find_model(model), header + row + figure, "one", kGrid));
    };
    const auto ward = hash("ward", "roughness", "0.5");
    EXPECT_EQ(hash("ward", "roughness", "0.5"), ward);
    EXPECT_NE(hash("ward", "roughness", "0.6"), ward);
    EXPECT_NE(hash("blinn-phong", "exponent", "0.5"), ward);
    // As it was when ABC was the only model.
    const auto abc = open_model("abc");
    ContentHash content(1);
    read_material(*abc, 0, content.sink(0), [](VoxelRange, std::span<const double>) {});
    EXPECT_EQ(content.material_digest(0, abc->grid().text()), "b158bc623aa78daa4fba66c9ee978faa");
}

TEST(ModelDatabase, TablesThatCannotBeUsedAreRefused) {
    const std::string row = "m,0.1,0.2,0.3,0.4,0.5,0.6,0.2\n";
    expect_refused([&] { ward_of(""); }, "mine.csv, line 1: found no row; expected a header");
    expect_refused([&] { ward_of(kWard); }, "line 1: found no row after the header");
    expect_refused([&] { ward_of(row); }, "line 1: found the column \"m\"");
    expect_refused(
        [&] { ward_of("material,diffuse_red,diffuse_green,diffuse_blue,roughness\nm,1,1,1,1\n"); },
        "line 1: found no column \"specular_red\" in 5 columns");
    expect_refused([&] { ward_of("diffuse_red\n1\n"); }, "no column \"material\" in 1 column");
    auto header = kWard;
    header.insert(header.size() - 1, ",anisotropy");
    expect_refused([&] { ward_of(header); }, "found the column \"anisotropy\" in 9 columns");
    header = kWard;
    header.insert(header.size() - 1, ",roughness");
    expect_refused([&] { ward_of(header); }, "found the column \"roughness\" twice");
    header = kWard;
    header.insert(header.find("roughness"), ",");
    expect_refused([&] { ward_of(header); }, "found the column \"\" in 9 columns");
    for (const char* number :
         {"", "nan", "inf", "-inf", "1e999", "0x1", "1 ", " 1", "1,5", "one"}) {
        expect_refused(
            [&] { ward_of(kWard + row + "n,0.1,0.2,\"" + number + "\",0.4,0.5,0.6,0.2\n"); },
            "mine.csv, line 3: the column diffuse_blue of \"n\": found \"" + std::string(number) +
                "\"; expected a finite number");
    }
    expect_refused([&] { ward_of(kWard + "m,1,2,3\n"); }, "line 2: found 4 fields; expected 8");
    expect_refused([&] { ward_of(kWard + row + "n,0,0,0,0,0,0,1\n" + row); },
                   "line 4: found the material \"m\" again, as in line 2");
    expect_refused([&] { ward_of(kWard + "\"m,1"); }, "line 2: found a quote");
    expect_refused([&] { ward_of(std::string("material\0", 9)); }, "found a byte 0");
}

TEST(ModelDatabase, FiguresThatMakeNoReflectanceAreRefused) {
    const auto refused = [](const char* figures, const char* found) {
        const auto database = ward_of(kWard + "m," + figures + "\n");
        expect_refused([&] { samples_of(*database, 0); },
                       std::string("mine.csv: ward makes \"m\" ") + found);
    };
    refused("0.1,0.2,0.3,0.4,0.5,0.6,0",
            "-nan/sr at voxel theta_h 0, theta_d 0, phi_d 0; expected");
    refused("0.1,-0.2,0.3,0,0,0,0.5", "-0.0");
    refused("1e13,0.2,0.3,0,0,0,0.5", "3183098861837.");
    refused("1e308,0.2,0.3,0,0,0,0.5", "3.18");
}

TEST(OpenModel, ByNameAndByTable) {
    const test::TemporaryDirectory directory;
    const auto table = (directory.path / "my params.csv").string();
    std::ofstream(table) << kWard << "m,0.1,0.2,0.3,0.4,0.5,0.6,0.2\n";
    EXPECT_TRUE(is_model("ward"));
    EXPECT_TRUE(is_model("ward:"));
    EXPECT_TRUE(is_model("ward:" + table));
    for (const char* name :
         {"", "./ward", "Ward", "ward.csv", "wardx:t.csv", ":t.csv", "built-in"}) {
        EXPECT_FALSE(is_model(name)) << name;
    }
    const auto name = "ward:" + table;
    const auto database = open_database(name);
    EXPECT_EQ(database->name(), name);
    EXPECT_EQ(database->path(), name);
    EXPECT_EQ(database->kind(), "ward table");
    EXPECT_EQ(open_model(name, kGrid)->grid(), kGrid);
    expect_refused([] { open_model("ward:"); }, "expected ward:TABLE.csv");
    expect_refused([] { open_model("phong:t.csv"); }, "\"phong\" is no model");
    expect_refused([&] { open_model(name + "x"); }, "my params.csvx: cannot be opened");
    expect_refused([&] { open_model("ward:" + directory.path.string()); }, "is not a regular file");
    std::ofstream(table) << kWard << "a/b,0.1,0.2,0.3,0.4,0.5,0.6,0.2\n";
    expect_refused([&] { open_database(name); }, "names become names of files");
}

TEST(ModelHeader, WrongLinesAreNamed) {
    const std::string rest =
        "// title: t\n// database: d\n// formula: f\n// source: s\n//   and more\n// table: t\n";
    const auto header = parse_model_header(
        rest + "// parameter: vec3 A of it\n// parameter: float n\n//   more\n", "my.glsl");
    EXPECT_EQ(header.source, "s and more");
    EXPECT_EQ(header.columns(), (std::vector<std::string>{"A_red", "A_green", "A_blue", "n"}));
    EXPECT_EQ(header.parameters[1].description, "more");
    const auto refused = [](const std::string& text, const std::string& words) {
        expect_refused([&] { parse_model_header(text, "my.glsl"); }, words);
    };
    refused(rest, "my.glsl: has no \"// parameter");
    refused("// parameter: vec3 A of it\n", "my.glsl: has no \"// title");
    refused(rest + "// tilte: t\n", "my.glsl:7: \"tilte:\" is no key");
    refused(rest + "// title: t\n", "my.glsl:7: a second \"title:\"");
    refused("// title:\n", "my.glsl:1: no value of \"title:\"");
    for (const char* parameter :
         {"", "vec3", "vec3 A", "vec2 A of", "A of it", "float 1a of it", "float a-b of it"}) {
        refused(rest + "// parameter: " + parameter, "my.glsl:7: the parameter is \"");
    }
    refused(rest + "// parameter: float a of it\n// parameter: vec3 a of it\n",
            "my.glsl:8: a second parameter a");
}

}  // namespace
}  // namespace merl::engine
