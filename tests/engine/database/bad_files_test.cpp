#include "engine/database/bad_files.h"

#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <fstream>
#include <limits>
#include <stdexcept>
#include <thread>

#include "engine/database/open_database.h"
#include "engine/database/subset_database.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

constexpr Grid kGrid = {.theta_h = 3, .theta_d = 5, .phi_d = 10};

/// A directory of made-up files.
class Directory {
  public:
    explicit Directory(std::size_t materials) {
        const test::FunctionDatabase made(kGrid, materials, test::random_sample);
        for (std::size_t m = 0; m < materials; ++m) {
            test::write_merl_file(path(made.materials()[m]), made, m);
            names.push_back(made.materials()[m]);
        }
    }

    std::filesystem::path path(const std::string& material) const {
        return directory.path / (material + ".binary");
    }

    void truncate(const std::string& material) const {
        std::filesystem::resize_file(path(material), 100);
    }

    /// The blue sample of the last voxel.
    void spoil(const std::string& material) const {
        const double none = std::numeric_limits<double>::quiet_NaN();
        std::fstream file(path(material), std::ios::binary | std::ios::in | std::ios::out);
        file.seekp(-8, std::ios::end);
        file.write(reinterpret_cast<const char*>(&none), sizeof(none));
    }

    std::vector<std::string> names;
    test::TemporaryDirectory directory;
};

template <typename Call>
std::string message_of(const Call& call) {
    try {
        call();
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(BadFiles, AllAreNamedWhenOpened) {
    const Directory files(6);
    files.truncate(files.names[1]);
    EXPECT_EQ(message_of([&] {
                  open_database(files.directory.path);
              }).find(files.path(files.names[1]).string()),
              0U);  // the only one speaks for itself
    files.truncate(files.names[4]);
    std::ofstream(files.path(files.names[5])) << "text";
    try {
        open_database(files.directory.path);
        FAIL();
    } catch (const BadFilesError& error) {
        EXPECT_EQ(std::string(error.what())
                      .find(files.directory.path.string() + ": 3 of 6 files cannot be used: "),
                  0U);
        for (const std::size_t m : {1U, 4U, 5U}) {
            EXPECT_NE(std::string(error.what()).find(files.path(files.names[m]).string()),
                      std::string::npos);
        }
    }
}

TEST(BadFiles, AllAreNamedWhenOneIsRead) {
    const Directory files(5);
    const auto database = open_database(files.directory.path);
    std::vector<double> samples(3 * kGrid.voxels());
    files.spoil(files.names[3]);
    const auto again = open_database(files.directory.path);
    const auto only = message_of([&] { again->read(3, {0, kGrid.voxels()}, samples); });
    EXPECT_EQ(only.find(files.path(files.names[3]).string()), 0U) << only;
    files.spoil(files.names[0]);
    const auto both = open_database(files.directory.path);
    both->read(0, {0, 7}, samples);  // nothing is wrong there
    // Several threads find it at once.
    std::array<std::string, 4> messages;
    {
        std::vector<std::jthread> threads;
        for (auto& message : messages) {
            threads.emplace_back([&] {
                std::vector<double> mine(3 * kGrid.voxels());
                message = message_of([&] { both->read(3, {0, kGrid.voxels()}, mine); });
            });
        }
    }
    for (const auto& message : messages) {
        EXPECT_NE(message.find("2 of 5 files cannot be used"), std::string::npos) << message;
        EXPECT_NE(message.find(files.path(files.names[0]).string()), std::string::npos) << message;
        EXPECT_NE(message.find("blue of voxel theta_h 2, theta_d 4, phi_d 9"), std::string::npos);
    }
}

TEST(BadFiles, AreSkippedWithTheirReasons) {
    const Directory files(6);
    files.truncate(files.names[1]);
    files.spoil(files.names[4]);
    const auto database = open_database(files.directory.path, {.skip_bad = true});
    EXPECT_EQ(database->materials(), (std::vector<std::string>{files.names[0], files.names[2],
                                                               files.names[3], files.names[5]}));
    ASSERT_EQ(database->skipped().size(), 2U);
    EXPECT_EQ(database->skipped()[0].material, files.names[1]);
    EXPECT_NE(database->skipped()[1].reason.find("blue of voxel"), std::string::npos);
    EXPECT_EQ(skipped_lines(*database).size(), 3U);
    const std::shared_ptr<const Database> whole =
        open_database(files.directory.path, {.skip_bad = true});
    EXPECT_EQ(make_subset(whole, {0, 1})->skipped().size(), 2U);

    // Of those that are wanted.
    const auto some =
        open_database(files.directory.path,
                      {.materials = std::vector{files.names[0], files.names[1], files.names[2]},
                       .skip_bad = true});
    EXPECT_EQ(some->materials(), (std::vector{files.names[0], files.names[2]}));
    ASSERT_EQ(some->skipped().size(), 1U);
    EXPECT_EQ(some->skipped()[0].material, files.names[1]);
    EXPECT_EQ(
        open_database(files.directory.path, {.materials = database->materials()})->materials(),
        database->materials());
}

TEST(BadFiles, AMaterialHasToBeLeft) {
    const Directory files(3);
    files.truncate(files.names[0]);
    files.spoil(files.names[2]);
    EXPECT_EQ(open_database(files.directory.path, {.skip_bad = true})->materials().size(), 1U);
    files.truncate(files.names[1]);
    const auto message =
        message_of([&] { open_database(files.directory.path, {.skip_bad = true}); });
    EXPECT_NE(message.find("none of 3 files can be used"), std::string::npos) << message;
    for (const auto& name : files.names) {
        EXPECT_NE(message.find(files.path(name).string()), std::string::npos) << message;
    }
}

TEST(BadFiles, TheGridIsThatOfMostFiles) {
    const Directory files(3);
    const test::FunctionDatabase other({.theta_h = 3, .theta_d = 4, .phi_d = 10}, 1,
                                       test::random_sample);
    test::write_merl_file(files.path("a"), other, 0);  // the first by name
    const auto message = message_of([&] { open_database(files.directory.path); });
    EXPECT_EQ(message.find(files.path("a").string()), 0U) << message;
    EXPECT_NE(message.find("3 x 4 x 10"), std::string::npos) << message;
    EXPECT_NE(message.find("3 x 5 x 10"), std::string::npos) << message;
    const auto database = open_database(files.directory.path, {.skip_bad = true});
    EXPECT_EQ(database->grid(), kGrid);
    EXPECT_EQ(database->materials(), files.names);
}

TEST(BadFiles, AFileOverTwoPiThatIsBadLeavesTheOthersOverPi) {
    const Directory files(2);
    const test::FunctionDatabase other(kGrid.over_two_pi(), 1, test::random_sample);
    test::write_merl_file(files.path("z"), other, 0);
    const OpenOptions options = {.skip_bad = true};
    EXPECT_EQ(open_database(files.directory.path, options)->grid(), kGrid.over_two_pi());
    files.spoil("z");
    EXPECT_EQ(open_database(files.directory.path, options)->grid(), kGrid);
}

TEST(BadFiles, LongListsAreCut) {
    std::vector<BadMaterial> bad(25);
    for (std::size_t i = 0; i < bad.size(); ++i) {
        bad[i].reason = "file " + std::to_string(i);
    }
    const auto lines = reasons(bad);
    ASSERT_EQ(lines.size(), 21U);
    EXPECT_EQ(lines[19], "file 19");
    EXPECT_EQ(lines[20], "and 5 more");
    EXPECT_EQ(reasons({bad.begin(), bad.begin() + 20}).size(), 20U);
    EXPECT_NE(std::string(BadFilesError("db", 30, bad).what()).find("; file 19; and 5 more"),
              std::string::npos);
}

TEST(BadFiles, FaultsAreThoseOfEachCall) {
    std::atomic<std::size_t> calls = 0;
    const auto faults = faults_of(1000, [&](std::size_t i) {
        ++calls;
        if (i % 3 == 0) {
            throw InputError(std::to_string(i));
        }
    });
    EXPECT_EQ(calls, 1000U);
    for (std::size_t i = 0; i < faults.size(); ++i) {
        EXPECT_EQ(faults[i], i % 3 == 0 ? std::to_string(i) : "");
    }
    EXPECT_TRUE(faults_of(0, [](std::size_t) {}).empty());
    EXPECT_THROW(faults_of(5, [](std::size_t) { throw std::runtime_error("other"); }),
                 std::runtime_error);
}

}  // namespace
}  // namespace merl::engine
