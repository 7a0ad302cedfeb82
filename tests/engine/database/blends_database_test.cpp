#include "engine/database/blends_database.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "engine/database/content_hash.h"
#include "engine/database/model_database.h"
#include "engine/database/open_database.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::expect_refused;
using test::hash_of_database;

constexpr Grid kGrid = {.theta_h = 3, .theta_d = 4, .phi_d = 5};

std::vector<double> samples_of(const Database& database, const std::string& material) {
    const auto place = std::ranges::lower_bound(database.materials(), material);
    EXPECT_EQ(*place, material);
    std::vector<double> samples(3 * database.grid().voxels());
    database.read(static_cast<std::size_t>(place - database.materials().begin()),
                  {0, database.grid().voxels()}, samples);
    return samples;
}

TEST(BlendsDatabase, HasTheBuiltInMaterialsAndBlendsOfThem) {
    const auto originals = open_model(kBuiltInModel, kGrid);
    const auto& names = originals->materials();
    const auto blends = open_database("blends:10000", {.grid = kGrid});
    EXPECT_EQ(blends->materials().size(), 10'000U);
    EXPECT_EQ(blends->kind(), built_in_kind);
    EXPECT_EQ(open_database(blends->path(), {.grid = kGrid})->materials(), blends->materials());
    EXPECT_TRUE(std::ranges::includes(blends->materials(), names));
    EXPECT_EQ(samples_of(*blends, names[7]), samples_of(*originals, names[7]));
    // The first blends are of neighbours, half and half; those of the second round begin after all
    // 4,950 pairs, and those of the third after that.
    const auto expect_blend = [&](const std::string& name, double weight, std::size_t first,
                                  std::size_t second) {
        const auto a = samples_of(*originals, names[first]);
        const auto b = samples_of(*originals, names[second]);
        const auto found = samples_of(*blends, name);
        for (std::size_t i = 0; i < found.size(); ++i) {
            ASSERT_EQ(found[i], weight * a[i] + (1 - weight) * b[i]) << name;
        }
    };
    expect_blend("blend-00100", 0.5, 0, 1);
    expect_blend("blend-00198", 0.5, 98, 99);
    expect_blend("blend-00199", 0.5, 0, 2);
    expect_blend("blend-05049", 0.5, 0, 99);
    expect_blend("blend-05050", 0.25, 0, 1);
    expect_blend("blend-09999", 0.25, 0, 99);
}

TEST(BlendsDatabase, FewAreSomeOfTheBuiltInOnes) {
    const auto names = merl_materials();
    for (const std::size_t materials : {2U, 7U, 99U, 100U}) {
        const auto some = open_blends("blends:" + std::to_string(materials), kGrid);
        EXPECT_EQ(some->materials().size(), materials);
        EXPECT_TRUE(std::ranges::includes(names, some->materials()));
    }
    const auto built_in = open_model(kBuiltInModel, kGrid);
    EXPECT_EQ(hash_of_database(*open_blends("blends:100", kGrid)), hash_of_database(*built_in));
}

TEST(BlendsDatabase, NoTwoAreTheSame) {
    const auto most = open_blends("blends:100000", {.theta_h = 2, .theta_d = 2, .phi_d = 2});
    EXPECT_NO_THROW(require_usable(*most));
    std::set<std::string> contents;
    for (std::size_t m = 0; m < most->materials().size(); ++m) {
        std::string content;
        std::vector<double> samples(24);
        most->read(m, {0, 8}, samples, [&](std::size_t plane, std::span<const std::byte> bytes) {
            EXPECT_EQ(plane, 0U);
            content.append(reinterpret_cast<const char*>(bytes.data()), bytes.size());
        });
        EXPECT_TRUE(contents.insert(content).second) << most->materials()[m];
    }
}

TEST(BlendsDatabase, SamplesDoNotDependOnTheRangeNorOnWhatIsKept) {
    const Grid grid = {.theta_h = 20, .theta_d = 30, .phi_d = 60};
    const auto blends = open_blends("blends:300", grid);
    const auto material = blends->materials()[150];
    const auto whole = samples_of(*blends, material);
    EXPECT_EQ(blends->keep(~0ULL), 100 * 24 * grid.voxels());
    for (int repetition = 0; repetition < 2; ++repetition) {
        EXPECT_EQ(samples_of(*blends, material), whole);
    }
    for (std::uint64_t first = 0, step = 1; first < grid.voxels(); first += step, step += 997) {
        const VoxelRange range = {first, std::min(first + step, grid.voxels())};
        std::vector<double> part(3 * range.size());
        blends->read(150, range, part);
        for (std::size_t i = 0; i < part.size(); ++i) {
            const auto plane = i / range.size();
            ASSERT_EQ(part[i], whole[plane * grid.voxels() + first + i % range.size()]);
        }
    }
}

TEST(BlendsDatabase, RefusesWhatIsNoNumberOfMaterials) {
    for (const auto* name :
         {"blends:", "blends:1", "blends:0", "blends:-5", "blends:100001", "blends:1e3",
          "blends: 5", "blends:5 ", "blends:99999999999999999999", "blends:many"}) {
        expect_refused([&] { open_database(name); }, std::string(name) + ": found no number");
    }
    expect_refused([] { open_database("blends"); }, "there is no such database");
}

}  // namespace
}  // namespace merl::engine
