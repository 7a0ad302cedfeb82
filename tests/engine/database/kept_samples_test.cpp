#include "engine/database/kept_samples.h"

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include <atomic>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

constexpr Grid kGrid = {.theta_h = 20, .theta_d = 30, .phi_d = 100};  // 60,000 voxels, four chunks

/// A database of three materials that counts the voxels it computes.
class Computed {
  public:
    explicit Computed(KeptSamples::Order order = KeptSamples::Order::first)
        : kept(kGrid, 3, order) {}

    KeptSamples kept;
    std::atomic<std::uint64_t> computed = 0;

    /// Reads a range of a material, which has to be right.
    void read(std::size_t material, VoxelRange range) {
        std::vector<double> samples(3 * range.size());
        kept.read(material, range, samples, [&](VoxelRange part, std::span<double> planes) {
            computed += part.size();
            for (std::uint64_t i = 0; i < planes.size(); ++i) {
                planes[i] = number(material, i / part.size(), part.first + i % part.size());
            }
        });
        for (std::uint64_t i = 0; i < samples.size(); ++i) {
            ASSERT_EQ(samples[i],
                      number(material, i / range.size(), range.first + i % range.size()));
        }
    }

  private:
    static double number(std::size_t material, std::uint64_t plane, std::uint64_t voxel) {
        return static_cast<double>(voxel * 10 + plane * 3 + material);
    }
};

TEST(KeptSamples, AreComputedOnceWhereThereIsRoom) {
    const std::uint64_t material_bytes = 24 * kGrid.voxels();
    Computed of;
    of.read(1, {5, 30'000});
    of.read(1, {5, 30'000});
    EXPECT_EQ(of.computed, 2 * 29'995U);  // and no voxel more
    of.computed = 0;
    EXPECT_EQ(of.kept.keep(material_bytes), material_bytes);
    of.read(1, {20'000, 20'001});
    EXPECT_EQ(of.computed, 16'384U);
    of.read(1, {0, 60'000});
    of.read(1, {0, 60'000});
    of.read(1, {16'383, 32'769});
    EXPECT_EQ(of.computed, 60'000U);
    of.read(0, {7, 9});  // for which there is no room
    EXPECT_EQ(of.computed, 60'002U);
    EXPECT_EQ(of.kept.keep(0), material_bytes);
    EXPECT_EQ(of.kept.keep(~0ULL), 3 * material_bytes);
    of.read(0, {7, 9});
    of.read(0, {7, 9});
    EXPECT_EQ(of.computed, 60'002U + 16'384U);
}

TEST(KeptSamples, TheLastOnesStayWhereRangesOfAllAreRead) {
    constexpr std::uint64_t kChunk = 16'384;
    Computed of(KeptSamples::Order::last);
    EXPECT_EQ(of.kept.keep(3 * 24 * kChunk), 3 * 24 * kChunk);
    for (std::uint64_t first = 0; first < 3 * kChunk; first += 1024) {
        for (std::size_t material = 0; material < 3; ++material) {
            of.read(material, {first, first + 1024});
        }
    }
    EXPECT_EQ(of.computed, 9 * kChunk);  // nothing twice
    of.read(2, {2 * kChunk, 3 * kChunk});
    EXPECT_EQ(of.computed, 9 * kChunk);
    of.read(0, {0, 1});  // was dropped
    EXPECT_EQ(of.computed, 10 * kChunk);
    of.read(0, {0, kChunk});
    of.read(0, {59'999, 60'000});  // the last chunk is smaller
    of.read(0, {59'998, 60'000});
    EXPECT_EQ(of.computed, 10 * kChunk + 60'000 - 3 * kChunk);
}

TEST(KeptSamples, AreRightForAnyThreads) {
    for (const std::uint64_t bytes : {0U, 1'000'000U, 100'000'000U}) {
        Computed of(bytes == 1'000'000 ? KeptSamples::Order::last : KeptSamples::Order::first);
        of.kept.keep(bytes);
        tbb::parallel_for(0, 100, [&](int i) {
            const auto first = static_cast<std::uint64_t>(i) * 598;
            of.read(static_cast<std::size_t>(i) % 3, {first, first + 700});
        });
    }
}

TEST(KeptSamples, AFailureKeepsNothing) {
    KeptSamples kept(kGrid, 1);
    kept.keep(~0ULL);
    std::vector<double> samples(3);
    for (int i = 0; i < 2; ++i) {
        EXPECT_THROW(kept.read(0, {0, 1}, samples,
                               [](VoxelRange, std::span<double>) { throw InputError("bad"); }),
                     InputError);
    }
}

}  // namespace
}  // namespace merl::engine
