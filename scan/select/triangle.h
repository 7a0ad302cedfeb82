#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "scan/pairs/distance_table.h"

namespace merl::scan {

/// Three materials, as indices into the names; a < c. The triangle inequality says that D(a,c) is
/// at most D(a,b) + D(b,c).
struct Triple {
    std::uint32_t a;
    std::uint32_t b;
    std::uint32_t c;
    double ab;  ///< their distances
    double bc;
    double ac;
    /// (ac - (ab + bc)) / (ab + bc): above 0 exactly where the inequality fails of the three
    /// numbers as they are, infinite where ab and bc are 0 and ac is not.
    double excess;

    double ratio() const { return ac / (ab + bc); }
    bool operator==(const Triple&) const = default;
};

/// What the triples of materials say of the triangle inequality under one metric.
struct TriangleCheck {
    std::size_t metric;     ///< index into the table
    std::uint64_t triples;  ///< every pair with every third material: N (N-1) (N-2) / 2
    /// In how many of them it fails; none where there are too many to look at.
    std::optional<std::uint64_t> violations;
    /// The one with the largest excess, also where that is not above 0; of equal ones that with the
    /// first pair (a,c) in pair order, then the first b. None where all three distances are 0 in
    /// every triple, or there are fewer than three materials.
    std::optional<Triple> worst;
};

/// Looks at every triple of materials under some of the metrics of a table, as long as those have
/// no more than `max_streamed` (count.h) triples together. The distances are taken as they are,
/// without their bounds. O(N³) and 8 N² bytes, on the threads of the caller's arena; the result
/// does not depend on them. `progress` is called, one call at a time, with the share that is done;
/// what it throws comes out.
std::vector<TriangleCheck> check_triangles(const DistanceTable& table,
                                           std::span<const std::size_t> metrics,
                                           const std::function<void(double share)>& progress = {});

/// Writes triangle.csv: a row a check, empty fields where there is no number. Throws
/// std::system_error when writing fails.
void write_triangles(int file, const DistanceTable& table, std::span<const TriangleCheck> checks);

}  // namespace merl::scan
