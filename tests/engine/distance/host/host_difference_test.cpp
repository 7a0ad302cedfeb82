#include "engine/distance/host/host_difference.h"

#include <gtest/gtest.h>
#include <hwy/highway.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <map>
#include <vector>

#include "tests/engine/support.h"

namespace merl::engine {
namespace {

constexpr std::array kDegrees = {2.0 / 3, 1.0, 2.0};

/// Calls `test` once for every instruction set of this processor that Highway has code for.
void with_every_target(const std::function<void(std::int64_t target)>& test) {
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        SCOPED_TRACE(hwy::TargetName(target));
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(hwy::SupportedTargets());
        test(target);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

/// As grids are: numbers of many sizes, of either sign, and zero.
std::vector<BlockScalars> random_blocks(std::size_t materials) {
    std::vector<BlockScalars> blocks(materials);
    for (std::size_t m = 0; m < materials; ++m) {
        for (std::size_t k = 0; k < kBlockScalars; ++k) {
            blocks[m][k] = static_cast<float>(test::random_sample(m, k / 3, k % 3));
        }
    }
    return blocks;
}

double exact_difference(double degree, const BlockScalars& a, const BlockScalars& b) {
    double sum = 0;
    for (std::size_t k = 0; k < kBlockScalars; ++k) {
        sum += std::pow(std::abs(static_cast<double>(a[k]) - static_cast<double>(b[k])), degree);
    }
    return sum;
}

constexpr float kUntouched = -1;

TEST(HostDifference, SumsAreThoseOfFloat64OnEveryInstructionSet) {
    const auto blocks = random_blocks(12);
    with_every_target([&](std::int64_t) {
        for (const double degree : kDegrees) {
            std::vector<float> sums(12 * 12, kUntouched);
            sum_differences(degree, {.rows = &blocks[0],
                                     .columns = &blocks[4],
                                     .row_count = 4,
                                     .column_count = 7,
                                     .sums = sums.data(),
                                     .stride = 12});
            for (std::size_t r = 0; r < 4; ++r) {
                for (std::size_t c = 0; c < 7; ++c) {
                    const double exact = exact_difference(degree, blocks[r], blocks[4 + c]);
                    EXPECT_NEAR(sums[12 * r + c] / exact, 1, 5e-7) << degree;
                }
                EXPECT_EQ(sums[12 * r + 7], kUntouched);
            }
        }
    });
}

TEST(HostDifference, OnTheDiagonalHasThePairsAboveIt) {
    const auto blocks = random_blocks(8);
    for (std::uint32_t count = 1; count <= 8; ++count) {
        std::vector<float> sums(64, kUntouched);
        sum_differences(2, {.rows = blocks.data(),
                            .columns = blocks.data(),
                            .row_count = count,
                            .column_count = count,
                            .sums = sums.data(),
                            .stride = 8});
        for (std::size_t r = 0; r < 8; ++r) {
            for (std::size_t c = r + 1; c < 8; ++c) {
                const double expected =
                    c < count ? exact_difference(2, blocks[r], blocks[c]) : kUntouched;
                EXPECT_NEAR(sums[8 * r + c] / expected, 1, 5e-7) << r << " " << c << " " << count;
            }
        }
    }
}

TEST(HostDifference, HasTheSameBitsInVectorsOfAnyWidth) {
    const auto blocks = random_blocks(8);
    std::map<bool, std::vector<std::vector<float>>> results;  // of targets that fuse, and others
    with_every_target([&](std::int64_t target) {
        auto& result = results[target <= HWY_AVX2].emplace_back(3 * 64);
        for (std::size_t d = 0; d < kDegrees.size(); ++d) {
            sum_differences(kDegrees[d], {.rows = &blocks[0],
                                          .columns = &blocks[4],
                                          .row_count = 4,
                                          .column_count = 3,
                                          .sums = &result[64 * d],
                                          .stride = 8});
        }
    });
    for (const auto& [fuses, of_targets] : results) {
        for (const auto& result : of_targets) {
            EXPECT_EQ(result, of_targets.front()) << fuses;
        }
    }
}

/// A pair has the same sum whichever others are computed beside it.
TEST(HostDifference, EveryTileGivesTheSameBits) {
    const auto blocks = random_blocks(12);
    with_every_target([&](std::int64_t) {
        for (const double degree : kDegrees) {
            for (const std::uint32_t rows : {1U, 3U, 4U, 5U}) {
                for (const std::uint32_t columns : {1U, 3U, 4U, 7U}) {
                    std::vector<float> sums(8 * 8, kUntouched);
                    sum_differences(degree, {.rows = &blocks[0],
                                             .columns = &blocks[5],
                                             .row_count = rows,
                                             .column_count = columns,
                                             .sums = sums.data(),
                                             .stride = 8});
                    for (std::uint32_t r = 0; r < 8; ++r) {
                        for (std::uint32_t c = 0; c < 8; ++c) {
                            float alone = kUntouched;
                            if (r < rows && c < columns) {
                                sum_differences(degree, {.rows = &blocks[r],
                                                         .columns = &blocks[5 + c],
                                                         .row_count = 1,
                                                         .column_count = 1,
                                                         .sums = &alone,
                                                         .stride = 1});
                            }
                            EXPECT_EQ(sums[8 * r + c], alone) << degree << " " << rows;
                        }
                    }
                }
            }
        }
    });
}

/// Four materials against four, in rows of eight sums.
void sum_four_by_four(double degree, const BlockScalars* rows, const BlockScalars* columns,
                      std::vector<float>& sums) {
    sum_differences(degree, {.rows = rows,
                             .columns = columns,
                             .row_count = 4,
                             .column_count = 4,
                             .sums = sums.data(),
                             .stride = 8});
}

/// The largest relative error of |d|^(2/3) for every `step`th float of [low, 8 low). All other
/// numbers of the block are equal.
double largest_power_error(float low, std::uint32_t step) {
    std::vector<BlockScalars> blocks(8);  // 4 to 7 are zero
    std::vector<float> sums(64);
    double largest = 0;
    std::uint32_t first = 0;
    std::uint32_t last = 0;
    const float ends[] = {low, 8 * low};
    std::memcpy(&first, &ends[0], 4);
    std::memcpy(&last, &ends[1], 4);
    for (std::uint32_t bits = first; bits < last; bits += 4 * step) {
        float x[4];
        for (std::uint32_t r = 0; r < 4; ++r) {
            const std::uint32_t one = bits + r * step;
            std::memcpy(&x[r], &one, 4);
            blocks[r].fill(0);
            blocks[r][bits % kBlockScalars] = x[r];
        }
        sum_four_by_four(2.0 / 3, &blocks[0], &blocks[4], sums);
        for (std::size_t r = 0; r < 4; ++r) {
            const double exact = std::pow(static_cast<double>(x[r]), 2.0 / 3);
            largest = std::max(largest, std::abs(static_cast<double>(sums[8 * r]) / exact - 1));
        }
    }
    return largest;
}

TEST(HostDifference, ThePowerIsAsExactAsTheBoundSays) {
    with_every_target([](std::int64_t) {
        EXPECT_LT(largest_power_error(1, 997), kHostRoundings.power);
        // It scales: three octaves more are 384 more in the upper half of the bits, 128 in its
        // third.
        for (const float low : {0x1p-120F, 0x1p-63F, 0x1p60F, 0x1p120F}) {
            EXPECT_LT(largest_power_error(low, 99'991), kHostRoundings.power) << low;
        }
    });
}

TEST(HostDifference, OfEqualAndOfTinyNumbersIsWhatItShouldBe) {
    std::vector<BlockScalars> blocks(8);
    for (std::size_t m = 0; m < 8; ++m) {
        blocks[m].fill(m < 4 ? 1e-30F : 0);
    }
    with_every_target([&](std::int64_t) {
        std::vector<float> sums(64);
        sum_four_by_four(2.0 / 3, &blocks[0], &blocks[4], sums);
        EXPECT_NEAR(sums[0] / (1e-20 * kBlockScalars), 1, 1e-6);
        for (const double degree : kDegrees) {
            sum_four_by_four(degree, &blocks[0], &blocks[0], sums);
            EXPECT_EQ(sums[1], 0);
        }
    });
}

TEST(HostDifference, NormsAreDifferencesFromZero) {
    const auto blocks = random_blocks(1);
    const BlockScalars zero = {};
    with_every_target([&](std::int64_t) {
        for (const double degree : {1.0, 2.0}) {
            EXPECT_NEAR(sum_norm(degree, blocks[0]) / exact_difference(degree, blocks[0], zero), 1,
                        1e-5);
        }
    });
}

TEST(HostDifference, RangesAreThoseOfFourNumbers) {
    const auto blocks = random_blocks(1);
    with_every_target([&](std::int64_t) {
        ChunkRanges ranges;
        find_ranges(blocks[0], ranges);
        for (std::size_t chunk = 0; chunk < ChunkRanges::kChunks; ++chunk) {
            const auto* const first = blocks[0].data() + 4 * chunk;
            const auto [low, high] = std::minmax_element(first, first + 4);
            EXPECT_EQ(ranges.low[chunk], *low);
            EXPECT_EQ(ranges.high[chunk], *high);
        }
    });
}

/// The largest size of a number in a chunk.
double size_of(const ChunkRanges& ranges, std::size_t chunk) {
    return std::max(std::abs(ranges.low[chunk]), std::abs(ranges.high[chunk]));
}

/// Every shape of a group has the pairs of its tile: an odd row, columns left over, the diagonal.
TEST(HostDifference, SlopesAreNoLessThanExactOnes) {
    // Some chunks far apart, some that overlap.
    constexpr std::size_t kMaterials = 9;
    auto blocks = random_blocks(kMaterials);
    for (std::size_t m = 0; m < kMaterials; ++m) {
        for (auto& number : blocks[m]) {
            number += 20 * static_cast<float>(m / 2);
        }
    }
    std::vector<ChunkRanges> ranges(kMaterials);
    const auto check = [&](std::size_t first_column, std::uint32_t rows, std::uint32_t columns) {
        std::vector<float> sums(kMaterials * kMaterials, kUntouched);
        sum_slopes({.rows = ranges.data(),
                    .columns = &ranges[first_column],
                    .row_count = rows,
                    .column_count = columns,
                    .sums = sums.data(),
                    .stride = kMaterials});
        for (std::size_t r = 0; r < kMaterials; ++r) {
            for (std::size_t c = first_column == 0 ? r + 1 : 0; c < kMaterials; ++c) {
                const float sum = sums[kMaterials * r + c];
                if (r >= rows || c >= columns) {
                    EXPECT_EQ(sum, kUntouched) << r << " " << c;
                    continue;
                }
                const auto& row = ranges[r];
                const auto& column = ranges[first_column + c];
                double exact = 0;
                for (std::size_t k = 0; k < ChunkRanges::kChunks; ++k) {
                    const double size = size_of(row, k) + size_of(column, k);
                    const double apart = std::max(static_cast<double>(row.low[k]) - column.high[k],
                                                  static_cast<double>(column.low[k]) - row.high[k]);
                    exact += size / std::cbrt(std::max(apart, size * 0x1p-24));
                }
                EXPECT_GT(sum, 0.966 * exact);
                EXPECT_LT(sum, 1.05 * exact);
            }
        }
    };
    with_every_target([&](std::int64_t) {
        for (std::size_t m = 0; m < kMaterials; ++m) {
            find_ranges(blocks[m], ranges[m]);
        }
        check(0, 8, 8);
        check(0, 7, 7);
        check(4, 3, 5);
        check(3, 2, 6);
    });
}

}  // namespace
}  // namespace merl::engine
