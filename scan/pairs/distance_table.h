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

    /// Two different ones of the metrics, by index, for the scan. Nothing is copied.
    Distances distances(std::size_t first, std::size_t second) &&;

    /// Two of the metrics, by index, as long as this stays as it is.
    DistancesView view(std::size_t first, std::size_t second) const;
};

/// Reads a table from CSV (csv_reader.h): that of parse_listed_distances (listed_distances.h), with
/// every pair of the materials that occur. Throws InputError. O(P log P).
DistanceTable parse_distance_table(std::string_view text, const std::string& file,
                                   std::span<const std::string> columns = {},
                                   const std::function<void(double share)>& progress = {});

/// Writes material_1,material_2 and a column per metric: one row a pair, in pair order, numbers in
/// the fewest digits that read back the same. Throws std::system_error when writing fails.
void write_distance_table(int file, const DistanceTable& table,
                          const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
