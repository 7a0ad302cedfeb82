#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/distance_table.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {

/// The distances of some pairs of materials under any number of metrics.
struct ListedDistances {
    std::vector<std::string> names;     ///< ascending bytewise
    std::vector<Pair> pairs;            ///< indices into names, ascending, each once
    std::vector<MetricColumn> metrics;  ///< with a number a pair, in the order of `pairs`

    std::uint32_t materials() const { return static_cast<std::uint32_t>(names.size()); }

    /// Where a pair is among them, if it is. O(log P).
    std::optional<std::size_t> place_of(Pair pair) const;
};

/// Two different materials as a pair, whichever comes first.
constexpr Pair pair_of(std::uint32_t a, std::uint32_t b) {
    return a < b ? Pair{a, b} : Pair{b, a};
}

/// Reads a table of distances from CSV (csv_reader.h), in one of two forms.
///
/// A row a pair: the header is `material_1,material_2`, or `material_a,material_b` as it was once
/// written, then the metrics; each row has two materials, in either order, and their distances. A
/// pair may be there again with the same distances, and a material with itself at 0. Columns
/// NAME_bound and NAME_precision beside a column NAME are no metrics, so pairs.csv can be read: the
/// numbers are taken as exact. With `columns` only those metrics are read, in that order, and other
/// columns may hold anything.
///
/// A square matrix: names after the first cell of the header, and the same names, in any order,
/// before the rows. It is symmetric, and 0 or empty on its diagonal; one of its two triangles may
/// be empty. The metric is called what the file is, without the ending.
///
/// Distances are finite and not negative. `file` is what errors call it. `progress` is called now
/// and then with the share that is read; what it throws comes out. Throws InputError. O(P log P)
/// for P pairs that are there.
ListedDistances parse_listed_distances(std::string_view text, const std::string& file,
                                       std::span<const std::string> columns = {},
                                       const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
