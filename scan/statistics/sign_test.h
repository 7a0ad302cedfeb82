#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace merl::scan {

/// The exact two-sided sign test: the probability that a fair coin, thrown a + b times, falls at
/// least as unevenly as a : b. 1 for 0 : 0. Below 10^-308 it may round to 0.
double sign_test(std::uint64_t a, std::uint64_t b);

/// p-values of one family, adjusted for being many (Holm 1979): any of them below x is a
/// rejection with a family-wise error rate of x.
std::vector<double> holm(std::span<const double> p_values);

}  // namespace merl::scan
