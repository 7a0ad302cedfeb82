#include "engine/database/open_database.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/memory_database.h"
#include "engine/database/model_database.h"
#include "engine/database/subset_database.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::expect_refused;
using test::hash_of_database;

constexpr Grid kGrid = {.theta_h = 3, .theta_d = 4, .phi_d = 5};

TEST(OpenDatabase, ByNameAndByPath) {
    EXPECT_EQ(open_database("")->kind(), built_in_kind);
    EXPECT_EQ(open_database(kBuiltIn)->kind(), built_in_kind);
    EXPECT_EQ(open_database("")->materials(), merl_materials());
    const test::TemporaryDirectory directory;
    expect_refused([&] { open_database(directory.path); }, "found 0 .binary files");
    expect_refused([&] { open_database(directory.path / "none"); }, "expected built-in");
    const test::FunctionDatabase two(kGrid, 2, test::random_sample);
    for (std::size_t m = 0; m < 2; ++m) {
        test::write_merl_file(directory.path / (two.materials()[m] + ".binary"), two, m);
    }
    const auto opened = open_database(directory.path);
    EXPECT_EQ(opened->materials(), two.materials());
    EXPECT_EQ(opened->path(), directory.path);
    EXPECT_NE(database_help().find("MERL"), std::string::npos);
}

TEST(OpenDatabase, AListingHasWhatCannotBeUsed) {
    const test::TemporaryDirectory directory;
    const test::FunctionDatabase two(kGrid, 2, test::random_sample);
    test::write_merl_file(directory.path / "a.binary", two, 0);
    std::ofstream(directory.path / "b.binary") << "no samples";
    const auto listing = list_database(directory.path);
    ASSERT_EQ(listing.materials.size(), 2U);
    EXPECT_EQ(listing.materials[0].open()->materials(), std::vector<std::string>{"a"});
    expect_refused([&] { listing.materials[1].open(); }, "b.binary");
    EXPECT_EQ(list_database((directory.path / "a.binary").string()).materials.size(), 1U);
    EXPECT_THROW(list_database(directory.path / "none"), InputError);
    const auto built_in = list_database(kBuiltIn);
    ASSERT_EQ(built_in.materials.size(), 100U);
    EXPECT_EQ(built_in.materials[7].open()->materials().front(), merl_materials()[7]);
}

TEST(MerlFile, HasTheReflectancesOfAnyDatabase) {
    const test::TemporaryDirectory directory;
    const test::FunctionDatabase two(kGrid, 2, test::random_sample);
    for (std::size_t m = 0; m < 2; ++m) {
        test::write_merl_file(directory.path / (two.materials()[m] + ".binary"), two, m);
    }
    const auto copy = open_database(directory.path);
    for (std::size_t m = 0; m < 2; ++m) {
        std::vector<double> original(3 * kGrid.voxels());
        std::vector<double> written(3 * kGrid.voxels());
        two.read(m, {0, kGrid.voxels()}, original);
        copy->read(m, {0, kGrid.voxels()}, written);
        for (std::size_t i = 0; i < original.size(); ++i) {
            EXPECT_NEAR(written[i], original[i], 1e-15 * std::abs(original[i])) << i;
        }
    }
}

TEST(SubsetDatabase, HandsOnWhatIdentifiesSamples) {
    const auto whole = std::make_shared<test::FunctionDatabase>(kGrid, 5, test::random_sample);
    const auto some = make_subset(whole, {1, 4});
    EXPECT_EQ(some->materials(),
              (std::vector<std::string>{whole->materials()[1], whole->materials()[4]}));
    std::vector<double> a(3);
    std::vector<double> b(3);
    some->read(1, {7, 8}, a);
    whole->read(4, {7, 8}, b);
    EXPECT_EQ(a, b);
    const auto again = make_subset(whole, {1, 4});
    EXPECT_EQ(hash_of_database(*some), hash_of_database(*again));
    EXPECT_NE(hash_of_database(*some), hash_of_database(*make_subset(whole, {1, 3})));
    EXPECT_EQ(hash_of_database(*make_subset(whole, {0, 1, 2, 3, 4})), hash_of_database(*whole));
    for (const auto& wrong : {std::vector<std::size_t>{1, 1}, {2, 1}, {5}, {0, 300}}) {
        EXPECT_THROW(make_subset(whole, wrong), std::invalid_argument);
    }
}

TEST(MemoryDatabase, RefusesWhatIsNoDatabase) {
    const std::vector<double> good(3 * kGrid.voxels(), 0.5);
    const auto make = [&](std::vector<std::string> names,
                          std::vector<std::vector<double>> samples) {
        return [=] { MemoryDatabase("made", kGrid, names, samples); };
    };
    EXPECT_NO_THROW(make({"a", "b"}, {good, good})());
    expect_refused(make({"a", "b"}, {good}), "samples of 1 materials; expected those of 2");
    expect_refused(make({"b", "a"}, {good, good}), "ascending");
    expect_refused(make({"a", "a"}, {good, good}), "different names");
    // Names become names of files.
    for (const auto* name : {"", "../evil", "/tmp/evil", "sub/x", ".hid", "..", "."}) {
        expect_refused(make({name, "~"}, {good, good}), "names of files");
    }
    expect_refused(make({std::string("a\0b", 3), "b"}, {good, good}), "is called \"a");
    for (const Grid& grid :
         {Grid{0, 2, 2}, Grid{2, 2, 0}, Grid{70'000, 1, 1}, Grid{9000, 9000, 9}}) {
        expect_refused([&] { MemoryDatabase("made", grid, {"a", "b"}, {{}, {}}); }, "the grid is");
    }
    expect_refused(make({"a", "b"}, {good, {1, 2, 3}}), "b has 3 numbers; expected 180");
    auto bad = good;
    for (const double value : {std::nan(""), 2e12}) {
        bad[17] = value;
        expect_refused(make({"a", "b"}, {good, bad}), "number 17 of b");
    }
}

}  // namespace
}  // namespace merl::engine
