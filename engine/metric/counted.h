#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

// What bounds the error of the features of a summary metric of the library (docs/numerics.md): its
// file is compiled once more (summary_twin.cpp.in), with numbers that know how far they can be from
// exact ones. Running error analysis: N. Higham, "Accuracy and Stability of Numerical Algorithms",
// 2nd edition, 2002, 3.3. What a metric needs and is not here yet does not compile.

namespace merl::engine::glsl::counted {

/// A float64 number, and a bound on its distance from what exact arithmetic would have made of
/// exact arguments. Bounds are computed in float64 themselves, and are off by some 1e-15 of
/// themselves for each operation before.
class Number {
  public:
    // As a double turns into a float in GLSL.
    Number(double value = 0) : value_(value) {}  // NOLINT(google-explicit-constructor)
    Number(double value, double error) : value_(value), error_(error) {}

    double value() const { return value_; }
    double error() const { return error_; }

    Number operator-() const { return {-value_, error_}; }
    friend Number operator+(const Number& a, const Number& b) {
        return rounded(a.value_ + b.value_, a.error_ + b.error_);
    }
    friend Number operator-(const Number& a, const Number& b) { return a + -b; }
    friend Number operator*(const Number& a, const Number& b) {
        return rounded(a.value_ * b.value_, std::abs(a.value_) * b.error_ +
                                                std::abs(b.value_) * a.error_ +
                                                a.error_ * b.error_ + kLeast);
    }
    /// a'/b' - a/b = ((a' - a) - (b' - b) a/b) / b', and |b'| >= |b| less its error.
    friend Number operator/(const Number& a, const Number& b) {
        const double quotient = a.value_ / b.value_;
        const double divisor = std::abs(b.value_) - b.error_;
        return rounded(quotient, divisor > 0
                                     ? (a.error_ + std::abs(quotient) * b.error_) / divisor + kLeast
                                     : kUnknown);
    }
    Number& operator+=(const Number& b) { return *this = *this + b; }
    Number& operator-=(const Number& b) { return *this = *this - b; }
    Number& operator*=(const Number& b) { return *this = *this * b; }
    Number& operator/=(const Number& b) { return *this = *this / b; }

    // A feature that compares what it computes jumps where an error decides. Files compare in their
    // windows, which nobody computes in this type.
    friend bool operator<(const Number& a, const Number& b) { return exact(a) < exact(b); }
    friend bool operator>(const Number& a, const Number& b) { return exact(a) > exact(b); }
    friend bool operator<=(const Number& a, const Number& b) { return exact(a) <= exact(b); }
    friend bool operator>=(const Number& a, const Number& b) { return exact(a) >= exact(b); }

    friend Number abs(const Number& a) { return {std::abs(a.value_), a.error_}; }
    friend Number max(const Number& a, const Number& b) {
        return {std::max(a.value_, b.value_), std::max(a.error_, b.error_)};
    }
    friend Number min(const Number& a, const Number& b) {
        return {std::min(a.value_, b.value_), std::max(a.error_, b.error_)};
    }
    /// |sqrt(x') - sqrt(x)| is at most the root of |x' - x|, and that over the sum of the roots.
    friend Number sqrt(const Number& a) {
        const double root = std::sqrt(a.value_);
        const double least = std::max(a.value_ - a.error_, 0.0);
        const double sum = root + std::sqrt(least);
        return rounded(root, std::min(std::sqrt(a.error_), sum > 0 ? a.error_ / sum : kUnknown));
    }
    /// ln is steepest at the smaller end. Those of C libraries are off by less than 1 ulp, 2 u.
    friend Number log(const Number& a) {
        const double logarithm = std::log(a.value_);
        const double error = a.error_ < a.value_ ? -std::log1p(-a.error_ / a.value_) : kUnknown;
        return rounded(logarithm, error + kUnit * std::abs(logarithm));
    }

  private:
    static constexpr double kUnit = 0x1p-53;
    static constexpr double kLeast = std::numeric_limits<double>::denorm_min();
    static constexpr double kUnknown = std::numeric_limits<double>::infinity();

    static Number rounded(double value, double error) {
        return {value, error + kUnit * std::abs(value)};
    }

    static double exact(const Number& a) {
        if (a.error_ > 0) {
            throw std::logic_error("a feature compares numbers that are not exact");
        }
        return a.value_;
    }

    double value_ = 0;
    double error_ = 0;
};

// Seen where they are called with plain numbers, too.
Number abs(const Number& a);
Number max(const Number& a, const Number& b);
Number min(const Number& a, const Number& b);
Number sqrt(const Number& a);
Number log(const Number& a);

/// vec3 of these.
struct Vector {
    explicit Vector(const Number& all = {}) : x(all), y(all), z(all) {}
    Vector(const Number& x_, const Number& y_, const Number& z_) : x(x_), y(y_), z(z_) {}

    friend Vector operator+(const Vector& a, const Vector& b) {
        return {a.x + b.x, a.y + b.y, a.z + b.z};
    }
    friend Vector operator-(const Vector& a, const Vector& b) {
        return {a.x - b.x, a.y - b.y, a.z - b.z};
    }
    friend Vector operator*(const Vector& a, const Vector& b) {
        return {a.x * b.x, a.y * b.y, a.z * b.z};
    }
    friend Vector operator/(const Vector& a, const Vector& b) {
        return {a.x / b.x, a.y / b.y, a.z / b.z};
    }

    Number x, y, z;
};

inline Vector log(const Vector& a) {
    return {log(a.x), log(a.y), log(a.z)};
}

}  // namespace merl::engine::glsl::counted
