#include "engine/database/over_two_pi.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/model_database.h"
#include "engine/database/open_database.h"
#include "engine/distance/distances.h"
#include "engine/distance/float64_distances.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using test::FunctionDatabase;

constexpr Grid kHalf = {.theta_h = 5, .theta_d = 4, .phi_d = 6};

/// Another database over pi, repeated over 2 pi: what a file over 2 pi of the same BRDF holds.
class Repeated final : public Database {
  public:
    explicit Repeated(const Database& half)
        : Database(half.name(), half.kind(), half.path()), half_(half) {
        grid_ = half.grid().over_two_pi();
        materials_ = half.materials();
    }

    void read(std::size_t material, VoxelRange range, std::span<double> samples,
              const SampleSink& sink) const override {
        read_over_two_pi(grid_, range, samples, sink, [&](auto part, auto to, const auto& hash) {
            half_.read(material, part, to, hash);
        });
    }

  private:
    const Database& half_;
};

std::vector<double> all_of(const Database& database, std::size_t material) {
    std::vector<double> samples(3 * database.grid().voxels());
    database.read(material, {0, database.grid().voxels()}, samples);
    return samples;
}

TEST(OverTwoPi, GridsAndDomains) {
    const Grid grid = kHalf.over_two_pi();
    EXPECT_EQ(grid.phi_d, 12U);
    EXPECT_EQ(grid.over_two_pi(), grid);
    EXPECT_EQ(grid.over_pi(), kHalf);
    EXPECT_EQ(kHalf.over_pi(), kHalf);
    EXPECT_EQ(Grid{}.text(), "90 x 90 x 180 (theta_h x theta_d x phi_d)");
    const Grid same_sizes = {.theta_h = 5, .theta_d = 4, .phi_d = 12};
    EXPECT_NE(grid, same_sizes);
    EXPECT_NE(grid.text(), same_sizes.text());
    const Domain half(kHalf);
    const Domain whole(grid);
    for (std::uint64_t i = 0; i < grid.voxels(); ++i) {
        const Voxel v = whole.voxel(i);
        const Voxel expected = half.voxel(i / 12 * 6 + i % 6);
        EXPECT_EQ(v.phi_d, expected.phi_d);
        EXPECT_EQ(v.cos_theta_i, expected.cos_theta_i);
        EXPECT_EQ(v.cos_theta_o, expected.cos_theta_o);
        EXPECT_EQ(v.solid_angle, expected.solid_angle);
        EXPECT_EQ(v.voxels, expected.voxels);
        EXPECT_EQ(v.s_merl, expected.s_merl);
        EXPECT_LT(v.phi_d, std::numbers::pi);
    }
}

TEST(OverTwoPi, AnyRangeOfAnythingRepeats) {
    const FunctionDatabase half(kHalf, 2, test::random_sample);
    const Repeated repeated(half);
    const Database& whole = repeated;
    const auto source = all_of(half, 1);
    std::mt19937 random(3);
    for (int i = 0; i < 400; ++i) {
        const std::uint64_t voxels = whole.grid().voxels();
        const std::uint64_t first = random() % voxels;
        const VoxelRange range = {first, first + 1 + random() % (voxels - first)};
        std::vector<double> got(3 * range.size());
        whole.read(1, range, got);
        for (std::size_t plane = 0; plane < 3; ++plane) {
            for (std::uint64_t v = range.first; v < range.last; ++v) {
                ASSERT_EQ(got[plane * range.size() + v - range.first],
                          source[plane * kHalf.voxels() + v / 12 * 6 + v % 6])
                    << range.first << ' ' << range.last << ' ' << v;
            }
        }
    }
}

TEST(OverTwoPi, WhatIdentifiesSamplesDoesNotDependOnThePieces) {
    const FunctionDatabase half(kHalf, 2, test::random_sample);
    const Repeated repeated(half);
    const Database& whole = repeated;
    std::string expected;
    for (const std::uint64_t piece : {240U, 1U, 5U, 6U, 7U, 12U, 13U, 100U}) {
        ContentHash hash(1);
        for (std::uint64_t first = 0; first < whole.grid().voxels(); first += piece) {
            const VoxelRange range = {first, std::min(first + piece, whole.grid().voxels())};
            std::vector<double> samples(3 * range.size());
            whole.read(1, range, samples, hash.sink(0));
        }
        const auto digest = hash.material_digest(0, whole.grid().text());
        expected = expected.empty() ? digest : expected;
        EXPECT_EQ(digest, expected) << piece;
    }
    EXPECT_NE(content_hash_of(whole, [](double) {}), content_hash_of(half, [](double) {}));
}

std::vector<MaterialPair> pairs_of(std::size_t materials) {
    std::vector<MaterialPair> pairs;
    for (std::uint32_t i = 0; i < materials; ++i) {
        for (std::uint32_t j = i + 1; j < materials; ++j) {
            pairs.emplace_back(i, j);
        }
    }
    return pairs;
}

/// Samples that differ between phi_d and pi - phi_d, so that it matters which direction a weight
/// takes for the incident one: CWCbrt's is cos^2 theta_i.
TEST(OverTwoPi, DistancesDoNotDependOnTheRange) {
    const FunctionDatabase half({.theta_h = 24, .theta_d = 11, .phi_d = 22}, 4,
                                test::random_sample);
    const Repeated whole(half);
    const auto pairs = pairs_of(4);
    std::vector<const Metric*> chosen;
    for (const auto& metric : metrics()) {
        chosen.push_back(&metric);
    }
    for (const auto* metric : chosen) {
        const auto expected = float64_distances(half, *metric, pairs);
        const auto got = float64_distances(whole, *metric, pairs);
        for (std::size_t p = 0; p < pairs.size(); ++p) {
            EXPECT_NEAR(got[p] / expected[p], 1, 1e-14) << metric->name;
        }
    }
    for (const bool in_shaders : {false, true}) {
        auto& engines = test::engines(in_shaders);
        const auto expected = compute_distances(engines, half, chosen);
        const auto got = compute_distances(engines, whole, chosen);
        for (std::size_t m = 0; m < chosen.size(); ++m) {
            const auto& a = expected.distances[m];
            const auto& b = got.distances[m];
            for (std::size_t p = 0; p < pairs.size(); ++p) {
                const double allowed =
                    chosen[m]->has_bound() ? a.bounds[p] + b.bounds[p] : 1e-4 * a.values[p];
                EXPECT_LE(std::abs(a.values[p] - b.values[p]), allowed + 1e-12 * a.values[p])
                    << chosen[m]->name << ' ' << in_shaders;
            }
        }
    }
}

/// f(i, o) and f(o, i) count alike: both halves of a grid over 2 pi have the weights over pi.
TEST(OverTwoPi, BothHalvesCountAlike) {
    const Grid grid = {.theta_h = 9, .theta_d = 9, .phi_d = 36, .phi_d_range = PhiDRange::two_pi};
    const auto lit = [](std::uint64_t from) {
        return [from](std::size_t material, std::uint64_t voxel, std::size_t) {
            const std::uint64_t phi = voxel % 36;
            return material == 1 && phi >= from && phi < from + 18
                       ? test::random_sample(0, voxel / 36 * 18 + phi - from, 0)
                       : 0.0;
        };
    };
    const FunctionDatabase before(grid, 2, lit(0));
    const FunctionDatabase after(grid, 2, lit(18));
    const std::vector<MaterialPair> pair = {{0, 1}};
    for (const auto* name : {"cwcbrt", "pawcielab", "cosine-rmse", "low-log"}) {
        const auto& metric = find_metric(name);
        const double first = float64_distances(before, metric, pair)[0];
        EXPECT_GT(first, 0);
        EXPECT_NEAR(float64_distances(after, metric, pair)[0] / first, 1, 1e-14) << name;
    }
}

TEST(OverTwoPi, ModelsRepeatBitByBit) {
    const Grid half = {.theta_h = 6, .theta_d = 7, .phi_d = 8};
    const auto expected = open_model(kBuiltInModel, half);
    const auto got = open_model(kBuiltInModel, half.over_two_pi());
    const Repeated repeated(*expected);
    for (const std::size_t material : {0U, 50U, 99U}) {
        EXPECT_EQ(all_of(*got, material), all_of(repeated, material));
    }
}

TEST(OverTwoPi, FilesNextToEachOther) {
    const test::TemporaryDirectory directory;
    const FunctionDatabase half({.theta_h = 6, .theta_d = 5, .phi_d = 10}, 3, test::random_sample);
    const Repeated whole(half);
    test::write_merl_file(directory.path / "a.binary", half, 0);
    test::write_merl_file(directory.path / "b.binary", whole, 0);
    test::write_merl_file(directory.path / "c.binary", half, 2);
    const auto database = open_database(directory.path);
    EXPECT_EQ(database->grid(), whole.grid());
    const auto& metric = find_metric("cwcbrt");
    const auto mixed = float64_distances(*database, metric, pairs_of(3));
    EXPECT_EQ(mixed[0], 0);         // a file and its extension
    EXPECT_EQ(mixed[1], mixed[2]);  // from both to the third
    // Next to files over pi alone nothing is over 2 pi.
    std::filesystem::remove(directory.path / "b.binary");
    const auto alone = open_database(directory.path);
    EXPECT_EQ(alone->grid(), half.grid());
    EXPECT_NEAR(float64_distances(*alone, metric, pairs_of(2))[0] / mixed[1], 1, 1e-14);
}

TEST(OverTwoPi, SizesCanBeReadEitherWay) {
    const test::TemporaryDirectory directory;
    const Grid usual = {.theta_h = 3, .theta_d = 5, .phi_d = 20};
    const FunctionDatabase two(usual, 2, test::random_sample);
    for (std::size_t m = 0; m < 2; ++m) {
        test::write_merl_file(directory.path / (two.materials()[m] + ".binary"), two, m);
    }
    EXPECT_EQ(open_database(directory.path)->grid().phi_d_range, PhiDRange::two_pi);
    EXPECT_EQ(open_database(directory.path, {.phi_d_range = PhiDRange::pi})->grid(), usual);
    const FunctionDatabase odd({.theta_h = 3, .theta_d = 5, .phi_d = 7}, 1, test::random_sample);
    test::write_merl_file(directory.path / "odd.binary", odd, 0);
    EXPECT_THROW(list_database(directory.path / "odd.binary", {.phi_d_range = PhiDRange::two_pi})
                     .materials[0]
                     .open(),
                 InputError);
}

}  // namespace
}  // namespace merl::engine
