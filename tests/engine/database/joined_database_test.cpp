#include "engine/database/joined_database.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/model_database.h"
#include "engine/database/open_databases.h"
#include "engine/database/subset_database.h"
#include "engine/distance/distances.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::hash_of_database;

namespace fs = std::filesystem;

constexpr Grid kGrid = {.theta_h = 6, .theta_d = 5, .phi_d = 8};

/// Throws what is expected, with these words.
void expect_refused(Fault fault, const std::string& words, const auto& open) {
    try {
        open();
        FAIL() << words;
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), fault) << error.what();
        EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what() << "\n"
                                                                            << words;
    }
}

/// A directory of MERL files of these materials of a made-up database of nine.
fs::path write_directory(const fs::path& directory, const std::vector<std::size_t>& materials,
                         const Grid& grid = kGrid) {
    fs::create_directory(directory);
    const test::FunctionDatabase made(grid, 9, test::random_sample);
    for (const auto m : materials) {
        test::write_merl_file(directory / (made.materials()[m] + ".binary"), made, m);
    }
    return directory;
}

std::shared_ptr<const Database> made(std::vector<std::string> names, const Grid& grid = kGrid) {
    return std::make_shared<MemoryDatabase>("made", grid, std::move(names), test::random_sample);
}

TEST(JoinedDatabase, HasTheMaterialsOfAllInOneOrder) {
    // "-" and "." come before "/", so the longer label does.
    const auto joined =
        make_joined({{"a", made({"x", "y"})}, {"b", made({"x"})}, {"a-b", made({"m", "n"})}});
    EXPECT_EQ(joined->materials(),
              (std::vector<std::string>{"a-b/m", "a-b/n", "a/x", "a/y", "b/x"}));
    EXPECT_NO_THROW(require_usable(*joined));
    ASSERT_EQ(joined->parts().size(), 3U);
    EXPECT_EQ(joined->parts()[1].label, "a");
    EXPECT_EQ(joined->parts()[1].first, 2U);
    EXPECT_EQ(joined->parts()[1].materials, 2U);
    EXPECT_EQ(own_names(*joined, joined->parts()[1]), (std::vector<std::string>{"x", "y"}));
    EXPECT_EQ(joined->kind(), "in memory");
    EXPECT_EQ(joined->path(), "");
    std::vector<double> samples(3 * kGrid.voxels());
    std::vector<double> expected(samples.size());
    joined->read(3, {0, kGrid.voxels()}, samples);
    made({"x", "y"})->read(1, {0, kGrid.voxels()}, expected);
    EXPECT_EQ(samples, expected);
    const auto some = make_subset(
        std::shared_ptr<const Database>(make_joined({{"a", made({"x", "y"})}, {"b", made({"x"})}})),
        {1});
    EXPECT_NO_THROW(require_usable(*some));
    ASSERT_EQ(some->parts().size(), 1U);
    EXPECT_EQ(some->parts()[0].materials, 1U);
}

TEST(JoinedDatabase, MaterialsHaveFilesOfTheirOwn) {
    EXPECT_EQ(file_stem("gold-paint"), "gold-paint");
    EXPECT_EQ(file_stem("merl/gold-paint"), "merl=gold-paint");
    EXPECT_NE(file_stem("a/b-c"), file_stem("a-b/c"));
    EXPECT_NE(file_stem("a/b=c"), file_stem("a-b/c"));
}

TEST(JoinedDatabase, LabelsOfOddCharactersAreRefused) {
    for (const auto& [label, reason] : {
             std::pair<std::string, const char*>("", "is empty"),
             {".hidden", "begins with a dot"},
             {"..", "begins with a dot"},
             {"a/b", "has a slash"},
             {"a=b", "has a \"=\""},
             {"a\nb", "nobody sees"},
             {std::string("a\0b", 3), "the label \"a"},
             {"\xff", "not UTF-8"},
             {"a\u202e"
              "b",
              "nobody sees"},
         }) {
        expect_refused(Fault::usage, reason, [&, wrong = label] {
            make_joined({{wrong, made({"x"})}});
        });
    }
    for (const std::string label : {"gold paint", "-", "@", "a,b", "*", "ö", "a.b"}) {
        EXPECT_EQ(make_joined({{label, made({"x"})}})->materials().front(), label + "/x");
    }
}

TEST(JoinedDatabase, WhatCannotBeJoined) {
    EXPECT_THROW(make_joined({}), std::invalid_argument);
    EXPECT_THROW(make_joined({{"a", make_joined({{"b", made({"x"})}})}}), std::invalid_argument);
    EXPECT_THROW(make_joined({{"a", made({"x"})}, {"a", made({"y"})}}), std::invalid_argument);
    expect_refused(Fault::input,
                   "made: the grid is 2 x 3 x 4 (theta_h x theta_d x phi_d), as of all of \"b\"; "
                   "made, of \"a\", has 6 x 5 x 8",
                   [] {
                       make_joined({{"a", made({"x"})}, {"b", made({"x"}, {2, 3, 4})}});
                   });
}

TEST(JoinedDatabase, SplitsKeepEveryBit) {
    const test::TemporaryDirectory directory;
    const auto whole = write_directory(directory.path / "whole", {0, 1, 2, 3, 4, 5, 6, 7, 8});
    const auto one = write_directory(directory.path / "one", {0, 1, 2, 3});
    const auto two = write_directory(directory.path / "two", {4, 5, 6, 7, 8});
    std::vector<const Metric*> metrics;
    for (const char* const name : {"cwcbrt", "pawcielab", "nielsen-log"}) {
        metrics.push_back(&find_metric(name));
    }
    const auto alone = open_database(whole);
    const auto joined = open_databases({.databases = {{"", one}, {"", two}}});
    for (const bool in_shaders : {false, true}) {
        const auto a = compute_distances(test::engines(in_shaders), *alone, metrics);
        const auto b = compute_distances(test::engines(in_shaders), *joined, metrics);
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            EXPECT_EQ(a.distances[m].values, b.distances[m].values);
            EXPECT_EQ(a.distances[m].bounds, b.distances[m].bounds);
        }
        EXPECT_EQ(a.material_hashes, b.material_hashes);
        EXPECT_TRUE(a.part_hashes.empty());
        EXPECT_EQ(b.part_hashes, (std::vector<std::string>{hash_of_database(*open_database(one)),
                                                           hash_of_database(*open_database(two))}));
        EXPECT_EQ(b.content_hash, hash_of_database(*joined));
    }
}

/// Says how much it keeps, as a database does whose samples take time to compute.
class Keeping final : public MemoryDatabase {
  public:
    explicit Keeping(std::uint64_t most)
        : MemoryDatabase("keeping", kGrid, {"m"}, test::random_sample), most_(most) {}
    std::uint64_t keep(std::uint64_t bytes) const override { return std::min(bytes, most_); }

  private:
    std::uint64_t most_;
};

TEST(JoinedDatabase, KeepsNoMoreThanItMay) {
    const auto joined = make_joined({{"a", std::make_shared<Keeping>(100)},
                                     {"b", made({"x"})},
                                     {"c", std::make_shared<Keeping>(1000)}});
    EXPECT_EQ(joined->keep(50), 50U);
    EXPECT_EQ(joined->keep(300), 300U);
    EXPECT_EQ(joined->keep(5000), 1100U);
}

TEST(OpenDatabases, LabelsAndNames) {
    const test::TemporaryDirectory directory;
    const auto one = write_directory(directory.path / "one", {0, 1});
    const auto two = write_directory(directory.path / "two", {1});
    const auto first = [](const DatabaseChoice& choice) {
        return open_databases(choice)->materials().front();
    };
    const std::string m0 = open_database(one)->materials().front();
    EXPECT_EQ(first({}), merl_materials().front());
    EXPECT_EQ(first({.databases = {{"", one}}}), m0);
    EXPECT_EQ(first({.databases = {{"x", one}}}), "x/" + m0);
    EXPECT_EQ(first({.databases = {{"", one}, {"z", two}}}), "one/" + m0);
    EXPECT_EQ(first({.databases = {{"", one / ""}, {"z", two}}}), "one/" + m0);
    EXPECT_EQ(first({.databases = {{"", two / ".." / "one"}, {"z", two}}}), "one/" + m0);
    EXPECT_EQ(open_databases({.databases = {{"", ""}, {"", one}}})->materials()[0],
              "built-in/" + merl_materials().front());
    const auto refused = [&](Fault fault, const std::string& words, const DatabaseChoice& choice) {
        expect_refused(fault, words, [&] { open_databases(choice); });
        expect_refused(fault, words, [&] { list_databases(choice); });
    };
    expect_refused(Fault::usage, "are the same database", [&] {
        open_databases({.databases = {{"", one}, {"x", one / "."}}});
    });
    refused(Fault::usage, "is named twice", {.databases = {{"", ""}, {"x", kBuiltIn}}});
    refused(Fault::usage, "the label \"two\"", {.databases = {{"two", one}, {"", two}}});
    refused(Fault::usage, "the label \"\" of the database /",
            {.databases = {{"", "/"}, {"", two}}});
    refused(Fault::input, "there is no such database",
            {.databases = {{"", directory.path / "none"}, {"", two}}});
    const auto odd = write_directory(directory.path / "a=b", {1});
    EXPECT_EQ(open_databases({.databases = {{"", odd}}})->materials().size(), 1U);
    refused(Fault::usage, "has a \"=\"", {.databases = {{"", odd}, {"", two}}});
}

TEST(OpenDatabases, OneGrid) {
    const test::TemporaryDirectory directory;
    const auto files = write_directory(directory.path / "files", {0, 1});
    const auto other = write_directory(directory.path / "other", {0}, {2, 3, 4});
    EXPECT_EQ(open_databases({})->grid(), Grid());
    EXPECT_EQ(open_databases({.grid = kGrid})->grid(), kGrid);
    for (const auto& databases :
         {std::vector<NamedDatabase>{{"", ""}, {"", files}}, {{"", files}, {"", ""}}}) {
        const auto both = open_databases({.databases = databases});
        EXPECT_EQ(both->grid(), kGrid);
        EXPECT_EQ(both->materials().size(), 102U);
        const auto listing = list_databases({.databases = databases});
        ASSERT_EQ(listing.materials.size(), 102U);
        EXPECT_EQ(listing.materials.front().material, "built-in/" + merl_materials().front());
        EXPECT_EQ(listing.materials.front().open()->grid(), kGrid);
    }
    EXPECT_EQ(open_databases({.databases = {{"", files}}, .grid = kGrid})->grid(), kGrid);
    for (const Grid& grid : {Grid{0, 2, 2}, Grid{65'536, 65'536, 65'536}, Grid{1, 65'537, 1}}) {
        expect_refused(Fault::input, "built-in: the grid is",
                       [&] { open_databases({.grid = grid}); });
        expect_refused(Fault::input, "built-in: the grid is",
                       [&] { list_databases({.grid = grid}); });
    }
    expect_refused(Fault::input, "which files keep; 2 x 3 x 4", [&] {
        open_databases({.databases = {{"", files}}, .grid = Grid{2, 3, 4}});
    });
    expect_refused(Fault::input, other.string() + "/material-0000.binary: the grid is 2 x 3 x 4",
                   [&] {
                       open_databases({.databases = {{"", files}, {"", other}, {"", ""}}});
                   });
}

TEST(OpenDatabases, SomeMaterials) {
    const test::TemporaryDirectory directory;
    const auto one = write_directory(directory.path / "one", {0, 1, 2});
    const auto two = write_directory(directory.path / "two", {2, 3});
    std::ofstream(two / "broken.binary") << "no samples";
    const auto names = open_database(one)->materials();
    // What is not wanted is not opened, and where nothing is wanted the database is left out.
    DatabaseChoice choice = {.databases = {{"", one}, {"", two}},
                             .materials = {.materials = {}, .exclude = {"two/b*"}}};
    EXPECT_EQ(open_databases(choice)->materials().size(), 5U);
    choice.materials = {.materials = {"one/*"}, .exclude = {names[0]}};
    const auto some = open_databases(choice);
    EXPECT_EQ(some->materials(), (std::vector<std::string>{"one/" + names[1], "one/" + names[2]}));
    ASSERT_EQ(some->parts().size(), 1U);
    EXPECT_EQ(list_databases(choice).materials.size(), 2U);
    // By their names, as a record has them, and of those by patterns.
    choice = {.databases = choice.databases, .exactly = {{"one/" + names[0], "two/" + names[2]}}};
    EXPECT_EQ(open_databases(choice)->materials(), *choice.exactly);
    choice.materials = {.materials = {"two/*"}};
    EXPECT_EQ(open_databases(choice)->materials().size(), 1U);
    for (const auto& [wrong, words] : {std::pair("one/nope", "found no material \"nope\""),
                                       {"three/m", "no database with the label"},
                                       {"m", "no database with the label"}}) {
        choice = {.databases = choice.databases, .exactly = {{wrong}}};
        expect_refused(Fault::input, words, [&] { open_databases(choice); });
    }
    choice = {.exactly = {{"nope"}}};
    expect_refused(Fault::input, "found no material \"nope\" among its 100",
                   [&] { open_databases(choice); });
    choice = {.materials = {.materials = {"gold-*"}}};
    const auto gold = open_databases(choice);
    EXPECT_EQ(gold->materials().size(), 4U);
    for (const auto& name : gold->materials()) {
        EXPECT_TRUE(name.starts_with("gold-")) << name;
    }
}

TEST(MaterialChoice, NamesAndPatterns) {
    const std::vector<std::string> names = {"a/[1]", "a/gold", "a/gold,red",
                                            "a/red", "b/gold", "b/*"};
    using Texts = std::vector<std::string>;
    const auto chosen = [&](const Texts& materials, const Texts& exclude = {}) {
        Texts result;
        for (const auto m : choose_materials(names, {materials, exclude}, "db")) {
            result.push_back(names[m]);
        }
        return result;
    };
    EXPECT_EQ(chosen({}), names);
    EXPECT_EQ(chosen({"gold"}), (Texts{"a/gold", "b/gold"}));
    EXPECT_EQ(chosen({"b/gold,red"}), (Texts{"a/red", "b/gold"}));
    EXPECT_EQ(chosen({"gold,red"}), (Texts{"a/gold,red"}));  // is the name of one
    EXPECT_EQ(chosen({"g?ld", "red"}), (Texts{"a/gold", "a/red", "b/gold"}));
    EXPECT_EQ(chosen({"[!gr]*"}), (Texts{"a/[1]", "b/*"}));
    EXPECT_EQ(chosen({"[1]"}), (Texts{"a/[1]"}));
    EXPECT_EQ(chosen({"b/\\*"}), (Texts{"b/*"}));
    EXPECT_EQ(chosen({"b/*"}), (Texts{"b/*"}));  // is the name of one
    EXPECT_EQ(chosen({"?/g*"}, {"gold,red"}), (Texts{"a/gold", "b/gold"}));
}

TEST(MaterialChoice, Lists) {
    const test::TemporaryDirectory directory;
    const auto list = (directory.path / "list").string();
    const std::vector<std::string> names = {"alum", "brass", "chrome", "x,y"};
    const auto chosen = [&](const std::string& text) {
        std::ofstream(list) << text;
        return choose_materials(names, {{"@" + list}}, "db");
    };
    using Places = std::vector<std::size_t>;
    EXPECT_EQ(chosen("alum\nc*\n"), (Places{0, 2}));
    EXPECT_EQ(chosen("\xef\xbb\xbf"
                     "alum\r\n\r\nx,y"),
              (Places{0, 3}));
    EXPECT_EQ(choose_materials(names, {{}, {"@" + list + ",brass"}}, "db"), (Places{2}));
    expect_refused(Fault::input, "found no line", [&] { chosen("\n\n"); });
    expect_refused(Fault::usage, list + ": \"@x\" matches none of the 4 materials of db",
                   [&] { chosen("alum\n@x\n"); });
    expect_refused(Fault::input, "found a zero byte", [&] { chosen(std::string("alum\0*", 6)); });
    expect_refused(Fault::input, list, [&] { chosen(std::string(2 << 20U, 'a')); });
    for (const auto* const wrong : {"@", "@/nowhere", "@/dev/null", "@/tmp"}) {
        EXPECT_THROW(choose_materials(names, {{wrong}}, "db"), InputError) << wrong;
    }
}

TEST(MaterialChoice, WhatMatchesNothing) {
    const std::vector<std::string> names = {"alum", "brass"};
    const auto refused = [&](const std::string& words, const MaterialChoice& choice) {
        expect_refused(Fault::usage, words, [&] { choose_materials(names, choice, "db"); });
    };
    refused("\"b\" matches none of the 2 materials of db", {{"alum,b"}});
    refused("\"\" matches none", {{"alum,"}});
    refused("\"Alum\" matches none", {{}, {"Alum"}});
    refused("\"x/alum\" matches none", {{"x/alum"}});
    refused("none of the 2 materials of db is left", {{}, {"*"}});
    refused("none of the 2 materials of db is left", {{"alum"}, {"a*"}});
    // Backtracking would take longer than the universe has been there.
    const std::vector<std::string> hostile = {std::string(200, 'a')};
    std::string pattern;
    for (int i = 0; i < 60; ++i) {
        pattern += "a*";
    }
    EXPECT_THROW(choose_materials(hostile, {{pattern + "b"}}, "db"), Error);
}

}  // namespace
}  // namespace merl::engine
