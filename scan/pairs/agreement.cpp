#include "scan/pairs/agreement.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace merl::scan {
namespace {

double ratio(double x, double y) {
    const auto [low, high] = std::minmax(x, y);
    return low == high ? 1 : low / high;
}

/// x * y as (exponent, mantissa in [0.5, 1)), which compares like the product.
std::pair<int, double> scaled_product(double x, double y) {
    int x_exponent = 0;
    int y_exponent = 0;
    int carry = 0;
    const double product = std::frexp(x, &x_exponent) * std::frexp(y, &y_exponent);
    const double mantissa = std::frexp(product, &carry);
    return {x_exponent + y_exponent + carry, mantissa};
}

double agreement_of_extremes(double d1a, double d1b, double d2a, double d2b) {
    const bool p_is_zero = d1a == 0 || d2b == 0;
    const bool q_is_zero = d1b == 0 || d2a == 0;
    if (p_is_zero && q_is_zero) {
        if (d1a == d1b) {
            return ratio(d2a, d2b);
        }
        return d2a == d2b ? ratio(d1a, d1b) : 1;
    }
    if (p_is_zero || q_is_zero) {
        return 0;
    }
    const auto p = scaled_product(d1a, d2b);
    const auto q = scaled_product(d1b, d2a);
    const auto& [low, high] = std::minmax(p, q);
    return std::ldexp(low.second / high.second, low.first - high.first);
}

}  // namespace

double agreement(double d1a, double d1b, double d2a, double d2b) {
    const double p = d1a * d2b;
    const double q = d1b * d2a;
    const double low = p < q ? p : q;
    const double high = p < q ? q : p;
    if (low >= 0x1p-500 && high <= 0x1p500) {
        return low / high;
    }
    return agreement_of_extremes(d1a, d1b, d2a, d2b);
}

Configuration make_configuration(std::span<const double> first, std::span<const double> second,
                                 std::uint32_t a, std::uint32_t b) {
    const double d1a = first[a];
    const double d1b = first[b];
    const double d2a = second[a];
    const double d2b = second[b];
    const bool a_is_left = d1a < d1b || (d1a == d1b && d2a > d2b);
    return {a_is_left ? a : b, a_is_left ? b : a, agreement(d1a, d1b, d2a, d2b)};
}

bool StrongerFirst::operator()(const Configuration& x, const Configuration& y) const {
    if (x.agreement != y.agreement) {
        return x.agreement < y.agreement;
    }
    return std::minmax(x.left, x.right) < std::minmax(y.left, y.right);
}

}  // namespace merl::scan
