// Highway compiles this file for one instruction set after the other, and picks one at run time.
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "engine/distance/host/float64_difference.cpp"
#include "engine/distance/host/float64_difference.h"

#include <hwy/foreach_target.h>
#include <hwy/highway.h>

#include <cmath>
#include <cstdint>

HWY_BEFORE_NAMESPACE();
namespace merl::engine::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;
/// What is added together is as far apart as in the widest vectors.
constexpr std::size_t kLanes = 8;
using Doubles = hn::CappedTag<double, kLanes>;
using Vector = hn::Vec<Doubles>;
constexpr std::size_t kWidth = HWY_MIN(kLanes, hn::MaxLanes(Doubles()));

/// a b + c, rounded once.
HWY_INLINE Vector fused(Vector a, Vector b, Vector c) {
#if HWY_NATIVE_FMA
    return hn::MulAdd(a, b, c);
#else
    constexpr Doubles d;
    HWY_ALIGN double x[kWidth];
    HWY_ALIGN double y[kWidth];
    HWY_ALIGN double z[kWidth];
    hn::Store(a, d, x);
    hn::Store(b, d, y);
    hn::Store(c, d, z);
    for (std::size_t i = 0; i < kWidth; ++i) {
        z[i] = std::fma(x[i], y[i], z[i]);
    }
    return hn::Load(d, z);
#endif
}

/// 1 - a b, rounded once.
HWY_INLINE Vector one_minus(Vector a, Vector b) {
    constexpr Doubles d;
#if HWY_NATIVE_FMA
    return hn::NegMulAdd(a, b, hn::Set(d, 1.0));
#else
    return fused(hn::Neg(a), b, hn::Set(d, 1.0));
#endif
}

/// About x^(-1/3) times a constant: dividing the bits of a number by three takes the root of its
/// exponent. Only the upper half of the bits is divided, as a product of 64 bits.
HWY_INLINE Vector inverse_cube_root(Vector x) {
    constexpr hn::RebindToUnsigned<Doubles> bits;
    constexpr std::uint64_t kSeed = 0x55471c6d1e108c3f;
    constexpr std::uint32_t kThird = 0x55555556;  // of 2^32
    const auto upper = hn::ShiftRight<32>(hn::BitCast(bits, x));
#if HWY_TARGET == HWY_SCALAR
    const auto third = hn::Set(bits, hn::GetLane(upper) * kThird);
#else
    constexpr hn::Repartition<std::uint32_t, decltype(bits)> halves;
    const auto third = hn::MulEven(hn::BitCast(halves, upper), hn::Set(halves, kThird));
#endif
    return hn::BitCast(Doubles(), hn::Sub(hn::Set(bits, kSeed), third));
}

// sum + weight |d|^degree.

/// With y from the bits, r = x y^3 is between 2.667 and 3.160, and y p(r) with a minimax polynomial
/// is x^(-1/3) (1 + 9.4e-7) at most. Two terms of the binomial series in what is left make the
/// power from that.
struct TwoThirds {
    HWY_INLINE Vector operator()(Vector sum, Vector weight, Vector difference) const {
        constexpr Doubles d;
        const auto x = hn::Abs(difference);
        const auto seed = inverse_cube_root(x);
        const auto r = hn::Mul(hn::Mul(x, seed), hn::Mul(seed, seed));
        auto p = fused(r, hn::Set(d, -0.0049261693372476874), hn::Set(d, 0.061472534387774884));
        p = fused(p, r, hn::Set(d, -0.31285764516686287));
        p = fused(p, r, hn::Set(d, 1.2116879085639347));
        const auto y = hn::Mul(seed, p);
        const auto xy = hn::Mul(x, y);
        const auto rest = one_minus(xy, hn::Mul(y, y));
        auto series = fused(rest, hn::Set(d, 2.0 / 9), hn::Set(d, 1.0 / 3));
        series = fused(series, rest, hn::Set(d, 1.0));
        return fused(weight, hn::Mul(xy, series), sum);
    }
};

struct One {
    HWY_INLINE Vector operator()(Vector sum, Vector weight, Vector difference) const {
        return fused(weight, hn::Abs(difference), sum);
    }
};

struct Two {
    HWY_INLINE Vector operator()(Vector sum, Vector weight, Vector difference) const {
        return fused(weight, hn::Mul(difference, difference), sum);
    }
};

double sum_of(const std::array<double, kLanes>& lanes) {
    return ((lanes[0] + lanes[1]) + (lanes[2] + lanes[3])) +
           ((lanes[4] + lanes[5]) + (lanes[6] + lanes[7]));
}

template <std::size_t kColumns, typename Power>
void sum_columns(Power power, const double* row, const ChannelSamples* const* columns,
                 const double* weights, double* sums) {
    constexpr Doubles d;
    std::array<double, kLanes> lanes[kColumns];
    const double* column[kColumns];
    for (std::size_t c = 0; c < kColumns; ++c) {
        column[c] = columns[c]->data();
    }
    for (std::size_t lane = 0; lane < kLanes; lane += kWidth) {
        Vector sum[kColumns];
        for (auto& of_column : sum) {
            of_column = hn::Zero(d);
        }
        for (std::size_t at = lane; at < kBlockVoxels; at += kLanes) {
            const auto weight = hn::LoadU(d, weights + at);
            const auto sample = hn::LoadU(d, row + at);
            for (std::size_t c = 0; c < kColumns; ++c) {
                sum[c] = power(sum[c], weight, hn::Sub(sample, hn::LoadU(d, column[c] + at)));
            }
        }
        for (std::size_t c = 0; c < kColumns; ++c) {
            hn::StoreU(sum[c], d, lanes[c].data() + lane);
        }
    }
    for (std::size_t c = 0; c < kColumns; ++c) {
        sums[c] = sum_of(lanes[c]);
    }
}

template <typename Power>
void sum_differences_of(Power power, const double* row, const ChannelSamples* const* columns,
                        std::size_t count, const double* weights, double* sums) {
    static_assert(kFloat64Columns == 4);
    switch (count) {
        case 4:
            return sum_columns<4>(power, row, columns, weights, sums);
        case 3:
            return sum_columns<3>(power, row, columns, weights, sums);
        case 2:
            return sum_columns<2>(power, row, columns, weights, sums);
        default:
            return sum_columns<1>(power, row, columns, weights, sums);
    }
}

void sum_differences(double degree, const double* row, const ChannelSamples* const* columns,
                     std::size_t count, const double* weights, double* sums) {
    if (degree < 1) {
        sum_differences_of(TwoThirds(), row, columns, count, weights, sums);
    } else if (degree == 1) {
        sum_differences_of(One(), row, columns, count, weights, sums);
    } else {
        sum_differences_of(Two(), row, columns, count, weights, sums);
    }
}

}  // namespace
}  // namespace merl::engine::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace merl::engine {

HWY_EXPORT(sum_differences);

void sum_float64_differences(double degree, const ChannelSamples& row,
                             std::span<const ChannelSamples* const> columns,
                             const BlockWeights& weights, std::span<double> sums) {
    HWY_DYNAMIC_DISPATCH(sum_differences)
    (degree, row.data(), columns.data(), columns.size(), weights.data(), sums.data());
}

}  // namespace merl::engine
#endif
