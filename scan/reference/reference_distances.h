#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "scan/pairs/listed_distances.h"
#include "scan/reference/approximations.h"
#include "scan/select/scan_tables.h"

namespace merl::scan {

/// The approximations of one original: so many of Approximations::list, from `begin` on.
struct OriginalRange {
    std::uint32_t original;  ///< an index into names
    std::size_t begin;
    std::size_t end;

    std::size_t size() const { return end - begin; }
};

/// The distances of originals and their approximations.
struct ReferenceDistances {
    Approximations approximations;
    ListedDistances table;               ///< of the pairs of approximations and no others
    std::vector<std::uint32_t> pairs;    ///< of each of approximations.list: which of the table
    std::vector<std::uint32_t> by_pair;  ///< the other way round: of each pair which of the list
    std::vector<OriginalRange> ranges;   ///< of those that have approximations, ascending

    /// The original and the approximation of a pair of the table.
    const Approximation& of_pair(std::uint32_t pair) const;

    /// The distances under a metric of the approximations of an original.
    std::vector<double> values_of(const OriginalRange& range, std::size_t metric) const;

    /// Whether all labels have an approximation of this original.
    bool is_complete(const OriginalRange& range) const {
        return range.size() == approximations.labels.size();
    }

    /// The pairs under the first two metrics, the original first.
    PairColumns columns() const;
};

/// Puts them together. Throws std::invalid_argument unless the table has the pairs of the
/// approximations and no others.
ReferenceDistances reference_distances(ListedDistances table, Approximations approximations);

}  // namespace merl::scan
