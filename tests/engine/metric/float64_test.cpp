#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "engine/device/submission.h"
#include "tests/engine/support.h"

namespace merl::device {
namespace {

/// What float64.comp computes.
enum Function : std::uint32_t {
    kLog,
    kLog2,
    kExp,
    kExp2,
    kPow,
    kSin,
    kCos,
    kTan,
    kAsin,
    kAcos,
    kAtan,
    kAtan2,
    kCubeRoot,
    kTwoThirdsPower
};

struct Pair {
    double a = 0, b = 0;
};

/// Runs one function on the device.
std::vector<double> on_device(Function function, const std::vector<Pair>& x) {
    auto& context = test::lavapipe();
    const std::uint64_t bytes = x.size() * sizeof(Pair);
    Buffer in(context, bytes, Traffic::upload);
    Buffer out(context, bytes / 2, Traffic::download);
    const Kernel kernel(context, "float64", test::compile(MERL_TEST_SHADERS "/metric/float64.comp"),
                        {.bindings = {Binding::storage, Binding::storage},
                         .constants = {static_cast<std::uint32_t>(function)},
                         .push_bytes = 4});
    Buffer* const buffers[] = {&in, &out};
    const BoundKernel bound(context, kernel, buffers);
    std::copy(x.begin(), x.end(), in.host_as<Pair>().begin());
    Submission work(context);
    work.begin();
    work.upload(in, bytes);
    const auto size = static_cast<std::uint32_t>(x.size());
    work.dispatch(bound, std::as_bytes(std::span(&size, 1)), (size + 63) / 64, 1);
    work.download(out, bytes / 2);
    work.submit();
    work.wait();
    context.check_validation();
    const auto result = out.host_as<double>();
    return {result.begin(), result.end()};
}

/// Evenly spread, or over the exponents when both ends are positive and far apart.
std::vector<Pair> spread(double low, double high) {
    std::vector<Pair> x;
    const bool by_exponent = low > 0 && high / low > 100;
    for (int i = 0; i <= 50'000; ++i) {
        const double t = i / 50'000.0;
        x.push_back({by_exponent ? std::exp(std::log(low) + t * (std::log(high) - std::log(low)))
                                 : low + t * (high - low),
                     0});
    }
    return x;
}

using Exact = std::function<long double(long double, long double)>;

/// The largest error relative to what `scale` gives for the exact value.
double largest_error(
    Function function, const std::vector<Pair>& x, const Exact& exact,
    const std::function<long double(long double)>& scale = [](long double y) { return y; }) {
    const auto y = on_device(function, x);
    double largest = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const long double expected = exact(x[i].a, x[i].b);
        const long double error = std::abs((y[i] - expected) / scale(expected));
        EXPECT_FALSE(std::isnan(error) && expected != 0) << x[i].a << " " << x[i].b;
        largest = std::max(largest, expected == 0 ? std::abs(y[i]) : static_cast<double>(error));
    }
    return largest;
}

constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Float64, Logarithms) {
    const Exact log = [](long double x, long double) { return std::log(x); };
    const Exact log2 = [](long double x, long double) { return std::log2(x); };
    for (const auto& x :
         {spread(1e-300, 1e300), spread(0.5, 2), spread(0.999, 1.001), spread(1e-310, 1e-300)}) {
        EXPECT_LT(largest_error(kLog, x, log), 1e-15);
        EXPECT_LT(largest_error(kLog2, x, log2), 1e-15);
    }
    EXPECT_EQ(on_device(kLog2, {{8, 0}, {0.25, 0}, {1, 0}}), (std::vector<double>{3, -2, 0}));
    const auto y = on_device(kLog, {{0, 0}, {-1, 0}, {kInfinity, 0}});
    EXPECT_EQ(y[0], -kInfinity);
    EXPECT_TRUE(std::isnan(y[1]));
    EXPECT_EQ(y[2], kInfinity);
}

TEST(Float64, Exponentials) {
    const Exact exp = [](long double x, long double) { return std::exp(x); };
    const Exact exp2 = [](long double x, long double) { return std::exp2(x); };
    EXPECT_LT(largest_error(kExp, spread(-707, 709.7), exp), 1e-15);
    EXPECT_LT(largest_error(kExp, spread(-1, 1), exp), 1e-15);
    EXPECT_LT(largest_error(kExp2, spread(-1021, 1023.9), exp2), 1e-15);
    EXPECT_LT(largest_error(kExp2, spread(-1, 1), exp2), 1e-15);
    const auto y = on_device(kExp, {{0, 0}, {800, 0}, {-800, 0}, {kInfinity, 0}, {-kInfinity, 0}});
    EXPECT_EQ(y, (std::vector<double>{1, kInfinity, 0, kInfinity, 0}));
    EXPECT_EQ(on_device(kExp2, {{10, 0}, {-3, 0}}), (std::vector<double>{1024, 0.125}));
}

TEST(Float64, Powers) {
    const Exact pow = [](long double x, long double y) { return std::pow(x, y); };
    std::mt19937_64 random(1);
    const auto uniform = [&] { return static_cast<double>(random() >> 11U) * 0x1p-53; };
    std::vector<Pair> usual;
    std::vector<Pair> large;
    for (int i = 0; i < 50'000; ++i) {
        usual.push_back({std::pow(10.0, 60 * uniform() - 30), 8 * uniform() - 4});
        large.push_back({std::pow(10.0, 6 * uniform() - 3), 180 * uniform() - 90});
    }
    EXPECT_LT(largest_error(kPow, usual, pow), (3 + 4) * 4e-16);
    EXPECT_LT(largest_error(kPow, large, pow), (3 + 90) * 4e-16);
    EXPECT_EQ(on_device(kPow, {{0, 0.5}, {2, 10}, {5, 0}}), (std::vector<double>{0, 1024, 1}));
    EXPECT_TRUE(std::isnan(on_device(kPow, {{-1, 0.5}})[0]));
}

/// Normal numbers of every exponent: its smallest, its largest, and some between.
std::vector<Pair> of_every_exponent() {
    std::mt19937_64 random(1);
    std::vector<Pair> x;
    for (int exponent = -1022; exponent < 1024; ++exponent) {
        x.push_back({std::ldexp(1.0, exponent), 0});
        x.push_back({std::ldexp(2 - 0x1p-52, exponent), 0});
        for (int i = 0; i < 30; ++i) {
            x.push_back(
                {std::ldexp(1 + static_cast<double>(random() >> 12U) * 0x1p-52, exponent), 0});
        }
    }
    return x;
}

TEST(Float64, RootsOfEveryExponent) {
    const auto x = of_every_exponent();
    const Exact cube_root = [](long double a, long double) { return std::cbrt(a); };
    const Exact power = [](long double a, long double) {
        const auto root = std::cbrt(std::abs(a));
        return root * root;
    };
    EXPECT_LT(largest_error(kCubeRoot, x, cube_root), 4e-16);
    EXPECT_LT(largest_error(kTwoThirdsPower, x, power), 1e-15);
    EXPECT_DOUBLE_EQ(on_device(kTwoThirdsPower, {{-8, 0}})[0], 4);
    EXPECT_EQ(on_device(kTwoThirdsPower, {{0, 0}})[0], 0);
    for (const double y : on_device(kCubeRoot, {{0, 0}, {0x1p-1074, 0}, {0x1.fp-1023, 0}})) {
        EXPECT_GE(y, 0);
        EXPECT_LT(y, 1e-102);
    }
}

TEST(Float64, LogarithmsAndPowersOfEveryExponent) {
    auto x = of_every_exponent();
    EXPECT_LT(largest_error(kLog, x, [](auto a, auto) { return std::log(a); }), 1e-15);
    for (auto& pair : x) {
        pair.b = 1.0 / 3;
    }
    EXPECT_LT(largest_error(kPow, x, [](auto a, auto b) { return std::pow(a, b); }),
              (3 + 1) * 4e-16);
    // The last normal results.
    EXPECT_LT(largest_error(kExp, spread(-708.39, -707), [](auto a, auto) { return std::exp(a); }),
              1e-15);
    EXPECT_EQ(on_device(kExp2, {{-1022, 0}, {-1021, 0}}),
              (std::vector<double>{0x1p-1022, 0x1p-1021}));
}

TEST(Float64, Trigonometry) {
    const auto one = [](long double) { return 1.0L; };
    const auto slope = [](long double y) { return 1 + y * y; };
    for (const auto& x : {spread(-4, 4), spread(-1e5, 1e5), spread(-1e-9, 1e-9)}) {
        EXPECT_LT(largest_error(
                      kSin, x, [](auto a, auto) { return std::sin(a); }, one),
                  1e-15);
        EXPECT_LT(largest_error(
                      kCos, x, [](auto a, auto) { return std::cos(a); }, one),
                  1e-15);
        EXPECT_LT(largest_error(
                      kTan, x, [](auto a, auto) { return std::tan(a); }, slope),
                  1e-15);
    }
    for (const auto function : {kSin, kCos, kTan}) {
        for (const double y :
             on_device(function, {{1.1e5, 0}, {-1e9, 0}, {1e300, 0}, {kInfinity, 0}})) {
            EXPECT_TRUE(std::isnan(y));
        }
    }
    EXPECT_LT(largest_error(kAsin, spread(-1, 1), [](auto a, auto) { return std::asin(a); }),
              2e-15);
    EXPECT_LT(largest_error(kAcos, spread(-1, 1), [](auto a, auto) { return std::acos(a); }),
              2e-15);
    const Exact atan = [](long double a, long double) { return std::atan(a); };
    EXPECT_LT(largest_error(kAtan, spread(-10, 10), atan), 1e-15);
    EXPECT_LT(largest_error(kAtan, spread(1e-20, 1e20), atan), 1e-15);
    std::vector<Pair> around = {{0, 1}, {1, 0}, {0, -1}, {-1, 0}, {0, 0}, {1, -1e-300}};
    for (int i = 0; i < 10'000; ++i) {
        around.push_back({std::sin(0.001 * i) * i, std::cos(0.001 * i) * i});
    }
    EXPECT_LT(largest_error(kAtan2, around, [](auto a, auto b) { return std::atan2(a, b); }),
              2e-15);
}

}  // namespace
}  // namespace merl::device
