// Highway compiles this file for one instruction set after the other, and picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/distance/host/host_difference.cpp"
#include "engine/distance/host/host_difference.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <algorithm>
#include <cmath>

HWY_BEFORE_NAMESPACE();
namespace merl::engine::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
using Floats = hn::CappedTag<float, 16>;
using Vector = hn::Vec<Floats>;

/// What is added together is as far apart as in the widest vectors.
constexpr std::size_t kLanes = 16;
constexpr std::size_t kWidth = HWY_MIN(kLanes, hn::MaxLanes(Floats()));
constexpr std::size_t kStep = std::size_t{kHostRun} * kLanes;  // numbers of one run

using Bits = hn::RebindToUnsigned<Floats>;

/// A third of the upper 16 bits of each number, as upper 16 bits; the others are zero.
HWY_INLINE hn::Vec<Bits> third_of_upper_half(hn::Vec<Bits> x) {
    constexpr Bits d;
    constexpr std::uint32_t kThird = 21845;  // of 2^16
#if HWY_TARGET == HWY_SCALAR
    const auto product = hn::Mul(hn::ShiftRight<16>(x), hn::Set(d, kThird));
    return hn::ShiftLeft<16>(hn::ShiftRight<16>(product));
#else
    constexpr hn::Repartition<std::uint16_t, Bits> halves;
    const auto thirds = hn::BitCast(halves, hn::Set(d, kThird << 16U));
    return hn::BitCast(d, hn::MulHigh(hn::BitCast(halves, x), thirds));
#endif
}

/// About x^(-1/3), times a constant that comes with the seed: dividing the bits of a float by three
/// takes the root of its exponent.
HWY_INLINE Vector inverse_cube_root(Vector x, std::uint32_t seed) {
    constexpr Bits d;
    return hn::BitCast(Floats(), hn::Sub(hn::Set(d, seed), third_of_upper_half(hn::BitCast(d, x))));
}

// sum + |d|^degree.

/// Relative error below 2.7e-7, the rounding of the product included, fused or not; mean below
/// 2e-9. With y about x^(-1/3) and e = x y^3 the power is x y e^(-1/3), for which there is a
/// minimax polynomial of degree 4. The scale of y makes its leading coefficient 1, and counting e
/// from where the cubic term vanishes saves another operation.
struct TwoThirds {
    HWY_INLINE Vector operator()(Vector sum, Vector difference) const {
        constexpr Floats d;
        const auto x = hn::Abs(difference);
        const auto y = inverse_cube_root(x, 0x54860111);
        const auto xy = hn::Mul(x, y);
        const auto e = hn::MulSub(xy, hn::Mul(y, y), hn::Set(d, 0.8331781F));
        auto p = hn::MulAdd(e, e, hn::Set(d, 0.40565732F));
        p = hn::MulAdd(p, e, hn::Set(d, -0.41880068F));
        p = hn::MulAdd(p, e, hn::Set(d, 1.0629632F));
        return hn::MulAdd(p, xy, sum);
    }
};

struct One {
    HWY_INLINE Vector operator()(Vector sum, Vector difference) const {
        return hn::Add(sum, hn::Abs(difference));
    }
};

struct Two {
    HWY_INLINE Vector operator()(Vector sum, Vector difference) const {
        return hn::MulAdd(difference, difference, sum);
    }
};

template <typename F>
auto with_power(double degree, F function) {
    return degree < 1 ? function(TwoThirds()) : degree == 1 ? function(One()) : function(Two());
}

/// Sums in float64, of the lanes that are eight apart.
using Totals = std::array<double, kLanes / 2>;

/// Adds the lanes of a vector, of which the first is `lane` of kLanes.
HWY_INLINE void add_lanes(Vector sum, std::size_t lane, Totals& totals) {
#if HWY_TARGET == HWY_SCALAR
    totals[lane % totals.size()] += static_cast<double>(hn::GetLane(sum));
#else
    constexpr hn::Repartition<double, Floats> d;
    constexpr hn::Rebind<float, decltype(d)> half;
    double* const low = totals.data() + lane % totals.size();
    double* const high = totals.data() + (lane + kWidth / 2) % totals.size();
    hn::StoreU(hn::Add(hn::LoadU(d, low), hn::PromoteTo(d, hn::LowerHalf(half, sum))), d, low);
    hn::StoreU(hn::Add(hn::LoadU(d, high), hn::PromoteTo(d, hn::UpperHalf(half, sum))), d, high);
#endif
}

float sum_of(const Totals& totals) {
    return static_cast<float>(((totals[0] + totals[1]) + (totals[2] + totals[3])) +
                              ((totals[4] + totals[5]) + (totals[6] + totals[7])));
}

/// One run of kRows materials against kColumns others. On the diagonal they are the same ones, and
/// only the pairs above it count.
template <std::size_t kRows, std::size_t kColumns, bool kDiagonal, typename Power>
HWY_INLINE void add_run(Power power, const BlockScalars* rows, const BlockScalars* columns,
                        std::size_t first, Totals (&totals)[kRows][kColumns]) {
    constexpr Floats d;
    constexpr auto first_column = [](std::size_t row) { return kDiagonal ? row + 1 : 0; };
    for (std::size_t lane = 0; lane < kLanes; lane += kWidth) {
        Vector sums[kRows][kColumns];
        for (auto& of_row : sums) {
            for (auto& sum : of_row) {
                sum = hn::Zero(d);
            }
        }
        for (std::size_t at = first + lane; at < first + kStep; at += kLanes) {
            Vector column[kColumns];
            for (std::size_t c = 0; c < kColumns; ++c) {
                column[c] = hn::LoadU(d, columns[c].data() + at);
            }
            for (std::size_t r = 0; r < kRows; ++r) {
                const auto row = kDiagonal ? column[r] : hn::LoadU(d, rows[r].data() + at);
                for (std::size_t c = first_column(r); c < kColumns; ++c) {
                    sums[r][c] = power(sums[r][c], hn::Sub(row, column[c]));
                }
            }
        }
        for (std::size_t r = 0; r < kRows; ++r) {
            for (std::size_t c = first_column(r); c < kColumns; ++c) {
                add_lanes(sums[r][c], lane, totals[r][c]);
            }
        }
    }
}

/// One block of the kRows materials from `row` on against the kColumns from `column` on.
template <std::size_t kRows, std::size_t kColumns, bool kDiagonal = false, typename Power>
void sum_group(Power power, const HostTile<BlockScalars>& tile, std::size_t row,
               std::size_t column) {
    static_assert(kBlockScalars % kStep == 0);
    Totals totals[kRows][kColumns] = {};
    for (std::size_t first = 0; first < kBlockScalars; first += kStep) {
        add_run<kRows, kColumns, kDiagonal>(power, tile.rows + row, tile.columns + column, first,
                                            totals);
    }
    for (std::size_t r = 0; r < kRows; ++r) {
        for (std::size_t c = 0; c < kColumns; ++c) {
            tile.sums[(row + r) * tile.stride + column + c] = sum_of(totals[r][c]);
        }
    }
}

/// As many pairs side by side as there are registers for, and the rows and columns left over one by
/// one.
template <typename Power>
void sum_differences_of(Power power, const HostTile<BlockScalars>& tile) {
    constexpr std::size_t kColumns = kHostGroup;
    constexpr std::size_t kRows = kWidth == kLanes ? 4 : 2;
    static_assert(kHostGroup % kRows == 0);
    const bool diagonal = tile.rows == tile.columns;
    const std::size_t grouped = tile.column_count / kColumns * kColumns;
    const std::size_t grouped_rows = std::size_t{tile.row_count} / kHostGroup * kHostGroup;
    for (std::size_t c = 0; c < grouped; c += kColumns) {
        for (std::size_t r = 0; r < (diagonal ? c : grouped_rows); r += kRows) {
            sum_group<kRows, kColumns>(power, tile, r, c);
        }
        if (diagonal) {
            sum_group<kColumns, kColumns, true>(power, tile, c, c);
        }
        for (std::size_t r = grouped_rows; !diagonal && r < tile.row_count; ++r) {
            sum_group<1, kColumns>(power, tile, r, c);
        }
    }
    for (std::size_t c = grouped; c < tile.column_count; ++c) {
        for (std::size_t r = 0; r < grouped_rows; r += kRows) {
            sum_group<kRows, 1>(power, tile, r, c);
        }
        for (std::size_t r = grouped_rows; r < (diagonal ? c : tile.row_count); ++r) {
            sum_group<1, 1>(power, tile, r, c);
        }
    }
}

void sum_differences(double degree, const HostTile<BlockScalars>& tile) {
    with_power(degree, [&](auto power) HWY_ATTR { sum_differences_of(power, tile); });
}

float sum_norm(double degree, const BlockScalars& scalars) {
    constexpr Floats d;
    return with_power(degree, [&](auto power) HWY_ATTR {
        Totals totals = {};
        for (std::size_t lane = 0; lane < kLanes; lane += kWidth) {
            auto sum = hn::Zero(d);
            for (std::size_t at = lane; at < kBlockScalars; at += kLanes) {
                sum = power(sum, hn::LoadU(d, scalars.data() + at));
            }
            add_lanes(sum, lane, totals);
        }
        return sum_of(totals);
    });
}

void find_ranges(const BlockScalars& scalars, ChunkRanges& ranges) {
    constexpr Floats d;
    static_assert(kBlockScalars == 4 * ChunkRanges::kChunks);
    for (std::size_t chunk = 0; chunk < ChunkRanges::kChunks; chunk += kWidth) {
        Vector x[4];
        hn::LoadInterleaved4(d, scalars.data() + 4 * chunk, x[0], x[1], x[2], x[3]);
        const auto low = hn::Min(hn::Min(x[0], x[1]), hn::Min(x[2], x[3]));
        const auto high = hn::Max(hn::Max(x[0], x[1]), hn::Max(x[2], x[3]));
        hn::StoreU(low, d, ranges.low.data() + chunk);
        hn::StoreU(high, d, ranges.high.data() + chunk);
    }
}

/// Of some chunks: their ranges, and the largest size of a number in each.
struct Chunks {
    Vector low, high, size;
};

HWY_INLINE Chunks load_chunks(const ChunkRanges& ranges, std::size_t at) {
    constexpr Floats d;
    const auto low = hn::LoadU(d, ranges.low.data() + at);
    const auto high = hn::LoadU(d, ranges.high.data() + at);
    return {low, high, hn::Max(hn::Neg(low), high)};
}

/// kRows materials against kColumns others.
template <std::size_t kRows, std::size_t kColumns>
void sum_slopes_of(const HostTile<ChunkRanges>& tile, std::size_t row, std::size_t column) {
    constexpr Floats d;
    Totals totals[kRows][kColumns] = {};
    for (std::size_t lane = 0; lane < kLanes; lane += kWidth) {
        Vector sums[kRows][kColumns];
        for (auto& of_row : sums) {
            for (auto& sum : of_row) {
                sum = hn::Zero(d);
            }
        }
        for (std::size_t at = lane; at < ChunkRanges::kChunks; at += kLanes) {
            Chunks rows[kRows];
            for (std::size_t r = 0; r < kRows; ++r) {
                rows[r] = load_chunks(tile.rows[row + r], at);
            }
            for (std::size_t c = 0; c < kColumns; ++c) {
                const Chunks other = load_chunks(tile.columns[column + c], at);
                for (std::size_t r = 0; r < kRows; ++r) {
                    const auto size = hn::Add(rows[r].size, other.size);
                    const auto apart =
                        hn::Max(hn::Sub(rows[r].low, other.high), hn::Sub(other.low, rows[r].high));
                    const auto gap = hn::Max(apart, hn::Mul(size, hn::Set(d, 0x1p-24F)));
                    sums[r][c] = hn::MulAdd(size, inverse_cube_root(gap, 0x54a25e4c), sums[r][c]);
                }
            }
        }
        for (std::size_t r = 0; r < kRows; ++r) {
            for (std::size_t c = 0; c < kColumns; ++c) {
                add_lanes(sums[r][c], lane, totals[r][c]);
            }
        }
    }
    for (std::size_t r = 0; r < kRows; ++r) {
        for (std::size_t c = 0; c < kColumns; ++c) {
            tile.sums[(row + r) * tile.stride + column + c] = sum_of(totals[r][c]);
        }
    }
}

/// kRows materials against all others of the tile from `column` on.
template <std::size_t kRows>
void sum_slopes_of_rows(const HostTile<ChunkRanges>& tile, std::size_t row, std::size_t column) {
    for (; column + kHostGroup <= tile.column_count; column += kHostGroup) {
        sum_slopes_of<kRows, kHostGroup>(tile, row, column);
    }
    for (; column < tile.column_count; ++column) {
        sum_slopes_of<kRows, 1>(tile, row, column);
    }
}

void sum_slopes(const HostTile<ChunkRanges>& tile) {
    const bool diagonal = tile.rows == tile.columns;
    std::size_t row = 0;
    for (; row + 2 <= tile.row_count; row += 2) {
        if (diagonal) {
            sum_slopes_of<1, 1>(tile, row, row + 1);
        }
        sum_slopes_of_rows<2>(tile, row, diagonal ? row + 2 : 0);
    }
    if (row < tile.row_count) {
        sum_slopes_of_rows<1>(tile, row, diagonal ? row + 1 : 0);
    }
}

}  // namespace
}  // namespace merl::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merl::engine {

HWY_EXPORT(sum_differences);
HWY_EXPORT(sum_norm);
HWY_EXPORT(find_ranges);
HWY_EXPORT(sum_slopes);

void sum_differences(double degree, const HostTile<BlockScalars>& tile) {
    HWY_DYNAMIC_DISPATCH(sum_differences)(degree, tile);
}

float sum_norm(double degree, const BlockScalars& scalars) {
    return HWY_DYNAMIC_DISPATCH(sum_norm)(degree, scalars);
}

void find_ranges(const BlockScalars& scalars, ChunkRanges& ranges) {
    HWY_DYNAMIC_DISPATCH(find_ranges)(scalars, ranges);
}

void sum_slopes(const HostTile<ChunkRanges>& tile) {
    HWY_DYNAMIC_DISPATCH(sum_slopes)(tile);
}

}  // namespace merl::engine
#endif
