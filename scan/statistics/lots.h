#pragma once

#include <cstdint>

namespace merl::scan {

/// The probability that of n draws, each a success with probability p, at least k are. Exact.
double at_least_by_lot(std::uint64_t n, std::uint64_t k, double p);

/// The same of at most k.
double at_most_by_lot(std::uint64_t n, std::uint64_t k, double p);

/// The probability that a fair coin, thrown n times, somewhere falls on one side, whichever,
/// `length` times in a row or more. Exact.
double run_by_lot(std::uint64_t n, std::uint64_t length);

}  // namespace merl::scan
