#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "engine/device/submission.h"
#include "engine/metric/check/code.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

/// What an expression of a, b and c gives on the device, in a metric of a user's.
template <typename Real>
std::vector<Real> on_device(const std::string& expression, const std::vector<Real>& numbers) {
    auto& context = test::lavapipe();
    const bool is_float = sizeof(Real) == 4;
    spirv::Module module(
        test::compile(MERL_TEST_SHADERS "/metric/check/guards.comp",
                      fmt::format("#define REAL {0}\n#define PAIR {1}vec2\n#define TRIPLE {1}vec3\n"
                                  "#define MATRIX {1}mat2\n#define EXPRESSION {2}\n",
                                  is_float ? "float" : "double", is_float ? "" : "d", expression)));
    guard_metric_code(module, check_metric_code(module, "test", "test"));
    const std::uint64_t bytes = numbers.size() * sizeof(Real);
    device::Buffer in(context, bytes, device::Traffic::upload);
    device::Buffer out(context, bytes / 3, device::Traffic::download);
    const device::Kernel kernel(context, "guards", module.words(),
                                {.bindings = {device::Binding::storage, device::Binding::storage},
                                 .constants = {},
                                 .push_bytes = 4});
    device::Buffer* const buffers[] = {&in, &out};
    const device::BoundKernel bound(context, kernel, buffers);
    std::copy(numbers.begin(), numbers.end(), in.host_as<Real>().begin());
    device::Submission work(context);
    work.begin();
    work.upload(in, bytes);
    const auto size = static_cast<std::uint32_t>(numbers.size() / 3);
    work.dispatch(bound, std::as_bytes(std::span(&size, 1)), (size + 63) / 64, 1);
    work.download(out, bytes / 3);
    work.submit();
    work.wait();
    context.check_validation();
    const auto result = out.host_as<Real>();
    return {result.begin(), result.begin() + size};
}

using Exact = std::function<double(double, double, double)>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

enum class Held {
    exactly,     // the same infinity, or NaN, or rounding
    not_silent,  // what is not finite may be any such; what is may be refused; else within 5e-4
};

/// Holds an expression to what it should give, for numbers of every kind.
template <typename Real>
void expect_real(const std::string& expression, int arguments, Held held, const Exact& exact) {
    using Limits = std::numeric_limits<Real>;
    const Real infinity = Limits::infinity();
    const Real largest = Limits::max();
    const std::vector<Real> kinds = {0,
                                     static_cast<Real>(-0.0),
                                     1,
                                     -1,
                                     static_cast<Real>(0.5),
                                     static_cast<Real>(-0.75),
                                     2,
                                     -3,
                                     100,
                                     static_cast<Real>(1e-6),
                                     static_cast<Real>(1e6),
                                     Limits::min(),
                                     largest,
                                     -largest,
                                     infinity,
                                     -infinity,
                                     Limits::quiet_NaN()};
    const std::vector<Real> one = {0};
    std::vector<Real> numbers;
    for (const auto a : kinds) {
        for (const auto b : arguments > 1 ? kinds : one) {
            for (const auto c : arguments > 2 ? kinds : one) {
                numbers.insert(numbers.end(), {a, b, c});
            }
        }
    }
    const auto results = on_device(expression, numbers);
    for (std::size_t i = 0; i < results.size(); ++i) {
        const Real a = numbers[3 * i];
        const Real b = numbers[3 * i + 1];
        const Real c = numbers[3 * i + 2];
        const auto expected = static_cast<Real>(exact(a, b, c));
        const Real y = results[i];
        bool fine = false;
        if (held == Held::not_silent) {
            fine =
                !std::isfinite(y) || (std::isfinite(expected) &&
                                      std::abs(y - expected) <= 5e-4 * std::abs(expected) + 1e-6);
        } else if (std::isfinite(expected) && std::isfinite(y)) {
            fine = std::abs(y - expected) <= 1e-6 * std::abs(expected) + 2 * Limits::min();
        } else {
            fine = std::isnan(expected) ? std::isnan(y) : y == expected;
        }
        EXPECT_TRUE(fine) << (sizeof(Real) == 4 ? "float32: " : "float64: ") << expression
                          << " of a = " << a << ", b = " << b << ", c = " << c << " is " << y
                          << ", expected " << expected;
    }
}

void expect(const std::string& expression, int arguments, Held held, const Exact& exact) {
    expect_real<float>(expression, arguments, held, exact);
    expect_real<double>(expression, arguments, held, exact);
}

bool any_nan(double a, double b, double c = 0) {
    return std::isnan(a) || std::isnan(b) || std::isnan(c);
}

TEST(Guards, ArithmeticIsThatOfIeee754) {
    const auto exactly = Held::exactly;
    expect("a / b", 2, exactly, [](double a, double b, double) { return a / b; });
    expect("(PAIR(1.0, a) / PAIR(1.0, b)).y", 2, exactly,
           [](double a, double b, double) { return a / b; });
    expect("(a / PAIR(1.0, b)).y", 2, exactly, [](double a, double b, double) { return a / b; });
    expect("a / 0.0", 1, exactly, [](double a, double, double) { return a / 0.0; });
    expect("(PAIR(a, 1.0) / PAIR(0.0, 1.0)).x", 1, exactly,
           [](double a, double, double) { return a / 0.0; });
    expect("a / (-0.0)", 1, exactly, [](double a, double, double) { return a / -0.0; });
    expect("0.0 / a", 1, exactly, [](double a, double, double) { return 0.0 / a; });
    expect("1.0 / a", 1, exactly, [](double a, double, double) { return 1.0 / a; });
    expect("divided(a, 0.0)", 1, exactly, [](double a, double, double) { return a / 0.0; });
    expect("over_count(a)", 1, exactly, [](double a, double, double) { return a / 0.0 + a; });
    expect("a * 0.0", 1, exactly, [](double a, double, double) { return a * 0.0; });
    expect("times(a, 0.0)", 1, exactly, [](double a, double, double) { return a * 0.0; });
    expect("(PAIR(a, 1.0) * 0.0).x", 1, exactly, [](double a, double, double) { return a * 0.0; });
    expect("dot(PAIR(a, b), PAIR(0.0))", 2, exactly,
           [](double a, double b, double) { return a * 0.0 + b * 0.0; });
    expect("a - a", 1, exactly, [](double a, double, double) { return a - a; });
    expect("a - b", 2, exactly, [](double a, double b, double) { return a - b; });
    expect("a * b + c", 3, Held::not_silent, [](double a, double b, double c) {
        const double product = a * b;
        return product + c;
    });
    expect("b == 0.0 ? 0.0 : a / b", 2, exactly,
           [](double a, double b, double) { return b == 0 ? 0 : a / b; });
    expect("mod(a, 0.0)", 1, exactly, [](double, double, double) { return kNan; });
    expect("isnan(a) || isinf(a) ? 1.0 : 0.0", 1, exactly,
           [](double a, double, double) { return std::isfinite(a) ? 0 : 1; });
}

TEST(Guards, ZerosThatTheDeviceKnowsAreLikeOthers) {
    const auto exactly = Held::exactly;
    const auto is_nan = [](double, double, double) { return kNan; };
    for (const char* zero :
         {"TRIPLE(cross(TRIPLE(a), TRIPLE(a))).x", "determinant(MATRIX(a, a, a, a))", "large(40)",
          "small(0)", "diagonal(0)"}) {
        expect(fmt::format("{0} / {0}", zero), 1, exactly, is_nan);
        expect(fmt::format("{0} * (1.0 / {0})", zero), 1, exactly, is_nan);
    }
    for (const char* sum : {"sum_of_large(a)", "sum_of_small(a)", "sum_of_diagonal(a)"}) {
        expect(sum, 1, exactly, is_nan);
    }
    for (const char* zero :
         {"uintBitsToFloat(0u)", "intBitsToFloat(0)", "uintBitsToFloat(uvec2(0u)).y"}) {
        expect_real<float>(fmt::format("a + {0} / {0}", zero), 1, exactly, is_nan);
        expect_real<float>(fmt::format("a + {0} * (1.0 / {0})", zero), 1, exactly, is_nan);
    }
    expect_real<float>("1.0 / intBitsToFloat(floatBitsToInt(a))", 1, exactly,
                       [](double a, double, double) { return 1 / a; });
    expect_real<double>("a + packDouble2x32(uvec2(0u)) * (1.0 / packDouble2x32(uvec2(0u)))", 1,
                        exactly, is_nan);
}

TEST(Guards, NoDifferenceIsHiddenInAFunction) {
    const auto exactly = Held::exactly;
    const auto finite = [](double a, double, double) { return std::isfinite(a) ? 0 : kNan; };
    expect("0.0 * distance(PAIR(a), PAIR(a))", 1, exactly, finite);
    expect("0.0 * distance(a, a)", 1, exactly, finite);
    expect("0.0 * cross(TRIPLE(a), TRIPLE(a)).x", 1, Held::not_silent, finite);
    expect("0.0 * determinant(MATRIX(a, a, a, a))", 1, Held::not_silent, finite);
    expect("0.0 * fma(a, REAL(1), -a)", 1, exactly, finite);
    expect("mix(a, b, 1.0)", 2, exactly,
           [](double a, double b, double) { return std::isfinite(a) ? b : kNan; });
    expect("0.0 * mix(REAL(1), REAL(1), a)", 1, exactly, finite);
    expect("mix(a, b, 0.25)", 2, Held::not_silent,
           [](double a, double b, double) { return 0.75 * a + 0.25 * b; });
    expect("smoothstep(a, a, b)", 2, Held::not_silent, [](double a, double b, double) {
        const double ratio = (b - a) / (a - a);
        const double t = std::isnan(ratio) ? kNan : std::clamp(ratio, 0.0, 1.0);
        return t * t * (3 - 2 * t);
    });
    expect("0.0 * mod(a, 1.0)", 1, exactly, finite);
}

TEST(Guards, NoNanIsLost) {
    const auto exactly = Held::exactly;
    expect("min(a, b)", 2, exactly,
           [](double a, double b, double) { return any_nan(a, b) ? kNan : std::min(a, b); });
    expect("max(a, b)", 2, exactly,
           [](double a, double b, double) { return any_nan(a, b) ? kNan : std::max(a, b); });
    expect("max(PAIR(a, 0.0), 0.0).x", 1, exactly,
           [](double a, double, double) { return std::isnan(a) ? kNan : std::max(a, 0.0); });
    expect("clamp(a, b, c)", 3, exactly, [](double a, double b, double c) {
        return any_nan(a, b, c) ? kNan : std::min(std::max(a, b), c);
    });
    expect("sign(a)", 1, exactly, [](double a, double, double) {
        return std::isnan(a) ? kNan : (a > 0 ? 1.0 : 0.0) - (a < 0 ? 1.0 : 0.0);
    });
    expect("step(a, b)", 2, exactly,
           [](double a, double b, double) { return any_nan(a, b) ? kNan : (b < a ? 0.0 : 1.0); });
    const auto smooth = [](double a, double range) {
        const double ratio = (0.25 - a) / range;
        const double t = std::isnan(ratio) ? kNan : std::clamp(ratio, 0.0, 1.0);
        return t * t * (3 - 2 * t);
    };
    expect_real<float>(
        "smoothstep(a, b, 0.25)", 2, Held::not_silent,
        [&](double a, double b, double) { return smooth(a, static_cast<float>(b - a)); });
    expect_real<double>("smoothstep(a, b, 0.25)", 2, Held::not_silent,
                        [&](double a, double b, double) { return smooth(a, b - a); });
    for (const char* whole : {"floor(a)", "ceil(a)", "trunc(a)", "roundEven(a)", "fract(a)"}) {
        expect(std::string("0.0 * ") + whole, 1, exactly,
               [](double a, double, double) { return std::isfinite(a) ? 0 : kNan; });
    }
    expect("abs(a)", 1, exactly, [](double a, double, double) { return std::abs(a); });
}

TEST(Guards, FunctionsGiveNoNumberWhereThereIsNone) {
    const auto exactly = Held::exactly;
    const auto silent = Held::not_silent;
    expect("sqrt(a)", 1, exactly, [](double a, double, double) { return std::sqrt(a); });
    expect("inversesqrt(a)", 1, exactly, [](double a, double, double) { return 1 / std::sqrt(a); });
    expect("normalize(a)", 1, silent, [](double a, double, double) { return a / std::abs(a); });
    expect("normalize(PAIR(a, b)).x", 2, silent,
           [](double a, double b, double) { return a / std::hypot(a, b); });
    expect("length(PAIR(a, b))", 2, silent,
           [](double a, double b, double) { return any_nan(a, b) ? kNan : std::hypot(a, b); });
    const auto of_one = [&](const std::string& function, double (*exact)(double)) {
        expect_real<float>(function + "(a)", 1, silent,
                           [exact](double a, double, double) { return exact(a); });
    };
    of_one("log", std::log);
    of_one("log2", std::log2);
    of_one("exp", std::exp);
    of_one("exp2", std::exp2);
    of_one("asin", std::asin);
    of_one("acos", std::acos);
    of_one("atan", std::atan);
    of_one("sinh", std::sinh);
    of_one("cosh", std::cosh);
    of_one("tanh", std::tanh);
    of_one("asinh", std::asinh);
    of_one("acosh", std::acosh);
    of_one("atanh", std::atanh);
    expect_real<float>("pow(a, b)", 2, silent, [](double a, double b, double) {
        return a < 0 || any_nan(a, b) || (a == 0 && b <= 0) ? kNan : std::pow(a, b);
    });
    expect_real<float>("atan(a, b)", 2, silent,
                       [](double a, double b, double) { return std::atan2(a, b); });
}

}  // namespace
}  // namespace merl::engine
