#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "scan/pairs/agreement.h"
#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

// The CSV tables of a scan. All write to an open file descriptor from where it stands, which may be
// a pipe; UTF-8 or whatever the names are, one header line, LF line ends, numbers in the fewest
// digits that read back the same. D1 and D2 stand for the metric names. They throw
// std::system_error when writing fails (a full disk) and std::invalid_argument for bad distances.
// Opening, syncing and closing the file is the caller's.

/// material_1,material_2,D1,D2 and, where bounds are known, D1_bound,D2_bound,D1_precision,
/// D2_precision (float32, or float64 where the bound is 0): one row a pair, in pair order.
/// `progress` as below.
void write_pairs(int file, const Distances& distances, const Progress& progress = {});

/// Pairs, by index, as the rows of configurations have them.
struct PairColumns {
    std::string_view first_metric;
    std::string_view second_metric;
    std::span<const double> first;  ///< distances under the first metric, a number a pair
    std::span<const double> second;
    std::function<std::array<std::string_view, 2>(std::uint32_t pair)> names;
};

/// left_1,left_2,right_1,right_2,D1_left,D1_right,D2_left,D2_right,agreement: one row a
/// configuration, in the given order. Rows are formatted on the threads of the caller's arena while
/// earlier ones are written, in pieces: memory does not grow with the rows.
/// After every few thousand rows `progress` is called with the share that is written, on any thread
/// but one at a time; what it throws ends the writing and comes out.
void write_disagreements(int file, const Distances& distances,
                         std::span<const Configuration> configurations,
                         const Progress& progress = {});
void write_disagreements(int file, const PairColumns& pairs,
                         std::span<const Configuration> configurations,
                         const Progress& progress = {});

/// rank, counted from 1, and the columns of write_disagreements.
void write_selection(int file, const Distances& distances,
                     std::span<const Configuration> configurations);
void write_selection(int file, const PairColumns& pairs,
                     std::span<const Configuration> configurations);

}  // namespace merl::scan
