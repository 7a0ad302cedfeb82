#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {

/// The distances of every pair under one metric.
struct MetricColumn {
    std::string metric;
    std::vector<double> values;  ///< in pair order
    std::vector<double> bounds;  ///< as in Distances; empty: all are exact
    bool is_final = false;       ///< likewise
};

/// The distances of every pair of materials under any number of metrics.
struct DistanceTable {
    std::vector<std::string> names;  ///< ascending bytewise
    std::vector<MetricColumn> metrics;

    std::uint32_t materials() const { return static_cast<std::uint32_t>(names.size()); }
    std::uint64_t pairs() const { return pair_count(names.size()); }

    /// Two of the metrics, by index, for the scan.
    Distances distances(std::size_t first, std::size_t second) const;
};

/// Reads a table from CSV (csv_reader.h). The header is `material_a,material_b` or
/// `material_1,material_2`, then the metrics. Each row has two materials, in either order, and
/// their distances, finite and not negative; every pair of the materials that occur has one row,
/// anywhere. Numbers are decimal, as C writes them. Columns NAME_bound and NAME_precision beside a
/// column NAME are no metrics, so pairs.csv can be read: the numbers are taken as exact.
///
/// With `columns` only those metrics are read, in that order, and other columns may hold anything.
/// `file` is what errors call it. `progress` is called now and then with the share that is read;
/// what it throws comes out. Throws InputError. O(P log P).
DistanceTable parse_distance_table(std::string_view text, const std::string& file,
                                   std::span<const std::string> columns = {},
                                   const std::function<void(double share)>& progress = {});

/// Writes material_a,material_b and a column per metric: one row a pair, in pair order, numbers in
/// the fewest digits that read back the same. Throws std::system_error when writing fails.
void write_distance_table(int file, const DistanceTable& table,
                          const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
