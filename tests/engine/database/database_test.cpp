#include "engine/database/database.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/base/error.h"
#include "engine/database/abc_database.h"
#include "engine/database/merl_directory.h"
#include "engine/database/merl_file.h"
#include "engine/distance/parts/slab_reader.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

TEST(AbcDatabase, HasTheMaterialsOfMerlInOrder) {
    const auto database = make_abc_database();
    const auto& names = database->materials();
    EXPECT_EQ(names.size(), 100U);
    EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
    const auto chrome = std::find(names.begin(), names.end(), "chrome");
    ASSERT_NE(chrome, names.end());
    EXPECT_EQ(*std::next(chrome), "chrome-steel");  // bytewise, without the extension
    EXPECT_EQ(database->kind(), "built-in stand-in");
}

TEST(AbcDatabase, IsTheFormulaOfTheSpecification) {
    // kd = 0.3, A = 7, B = 1000, C = 1.5, ior = 1.4 on a small grid, by the plain formula of Löw
    // et al. 2012.
    const Grid grid = {.theta_h = 5, .theta_d = 4, .phi_d = 6};
    const auto database = make_abc_database(grid, "header\nm,0.1,0.2,0.3,5,6,7,1000,1.5,1.4\n");
    std::vector<double> samples(3 * grid.voxels());
    database->read(0, {0, grid.voxels()}, samples);
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
        const double expected =
            0.3 / M_PI + f * masking * 7 / std::pow(1 + 1000 * (1 - std::cos(v.theta_h)), 1.5) /
                             (M_PI * v.cos_theta_i * v.cos_theta_o);
        EXPECT_NEAR(value / expected, 1, 1e-13);
    }
}

TEST(AbcDatabase, MalformedFiguresAreRefused) {
    for (const char* line : {"m,1,2,3", "m,1,2,3,4,5,6,7,8,x", "m,1,2,3,4,5,6,7,8,nan", "m"}) {
        EXPECT_THROW(make_abc_database({}, std::string("header\n") + line + "\n"), Error) << line;
    }
}

TEST(MerlDirectory, ReadsWhatWasWrittenAndSortsByMaterial) {
    const test::TemporaryDirectory directory;
    const test::FunctionDatabase source({.theta_h = 6, .theta_d = 5, .phi_d = 4}, 3,
                                        test::random_sample);
    for (std::size_t m = 0; m < 3; ++m) {
        const char* const names[] = {"chrome-steel", "chrome", "B"};
        write_merl_file(directory.path / (std::string(names[m]) + ".binary"), source, m);
    }
    std::ofstream(directory.path / "readme.txt") << "not a material";
    std::ofstream(directory.path / "._chrome.binary") << "what some archives leave behind";
    const auto database = open_merl_directory(directory.path);
    EXPECT_EQ(database->materials(), (std::vector<std::string>{"B", "chrome", "chrome-steel"}));
    EXPECT_EQ(database->grid(), source.grid());
}

TEST(MerlDirectory, FilesOfOneMaterialAreRefused) {
    const test::TemporaryDirectory directory;
    const test::FunctionDatabase source({.theta_h = 2, .theta_d = 2, .phi_d = 2}, 2,
                                        test::random_sample);
    write_merl_file(directory.path / "a.binary", source, 0);
    write_merl_file(directory.path / "a.BINARY", source, 1);
    EXPECT_THROW(open_merl_directory(directory.path), Error);
}

TEST(SlabReader, TheHashIdentifiesTheContent) {
    const Grid grid = {.theta_h = 9, .theta_d = 8, .phi_d = 7};
    const auto hash = [&](std::uint64_t step, std::uint64_t changed) {
        const test::FunctionDatabase database(
            grid, 3, [=](std::size_t m, std::uint64_t v, std::size_t c) {
                return test::random_sample(m, v, c) + (m == 1 && c == 2 && v == changed ? 1e-9 : 0);
            });
        const Domain domain(grid);
        const VoxelList voxels(domain, VoxelSet::above_horizon);
        SlabReader reader(database, voxels);
        for (std::uint64_t first = 0; first < voxels.size(); first += step) {
            reader.read(Slab(domain, voxels, first, std::min(first + step, voxels.size())),
                        [](std::size_t, auto, auto) {});
        }
        return reader.content_hash();
    };
    const std::string whole = hash(1000, ~0ULL);
    EXPECT_EQ(whole.size(), 32U);
    EXPECT_EQ(hash(1, ~0ULL), whole);
    EXPECT_EQ(hash(100, ~0ULL), whole);
    EXPECT_NE(hash(100, 0), whole);
    EXPECT_NE(hash(100, grid.voxels() - 1), whole);  // below the horizon: content all the same
}

}  // namespace
}  // namespace merl::engine
