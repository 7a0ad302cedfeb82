#include "engine/database/database.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/base/error.h"
#include "engine/database/merl_directory.h"
#include "engine/database/merl_file.h"
#include "engine/database/model_database.h"
#include "engine/distance/parts/slab_reader.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

TEST(BuiltInDatabase, HasTheMaterialsOfMerlInOrder) {
    const auto database = open_model(kBuiltInModel);
    const auto& names = database->materials();
    EXPECT_EQ(names.size(), 100U);
    EXPECT_TRUE(std::is_sorted(names.begin(), names.end()));
    const auto chrome = std::find(names.begin(), names.end(), "chrome");
    ASSERT_NE(chrome, names.end());
    EXPECT_EQ(*std::next(chrome), "chrome-steel");  // bytewise, without the extension
    EXPECT_EQ(database->kind(), "built-in stand-in");
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
        return content_digest(database.materials(), grid.text(), reader.plane_hashes());
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
