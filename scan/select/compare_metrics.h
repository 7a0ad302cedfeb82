#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/count.h"
#include "scan/pairs/distance_table.h"

namespace merl::scan {

/// Kendall's tau-b of two metrics over the pairs: (concordant - discordant) over the geometric mean
/// of the configurations not tied in the first and those not tied in the second (M. G. Kendall,
/// "The Treatment of Ties in Ranking Problems", Biometrika 33, 1945). None where a metric ties
/// everywhere.
std::optional<double> kendall_tau_b(const Counts& counts);

/// Two metrics of a table beside each other.
struct Comparison {
    std::size_t first;  ///< metrics, as indices into the table
    std::size_t second;
    Counts counts;
    std::optional<double> tau_b;
    /// Configurations whose order the bounds leave open; none where a bound is infinite.
    std::optional<std::uint64_t> undecided;
    /// The strongest disagreements, each with materials of its own; the first is the strongest of
    /// all.
    std::vector<Configuration> strongest;
};

/// Every two metrics of a table beside each other.
struct ComparisonResult {
    std::vector<Comparison> comparisons;  ///< (0,1), (0,2) … (1,2) …
    bool streamed;                        ///< every configuration was looked at too (scan.h)
};

/// Compares every two metrics of a table, with up to `strongest` disagreements each. Counts by
/// inversions, and by streaming too as long as all metric pairs together have no more than
/// `max_streamed` configurations. O(P log P) per two metrics and little more, on the threads of the
/// caller's arena; beside the table 36 bytes a pair, and with a million pairs or fewer that on each
/// thread. `progress` is called, one call at a time, with the share that is done, many times in
/// each comparison; what it throws comes out. Throws std::invalid_argument for bad distances.
ComparisonResult compare_metrics(const DistanceTable& table, std::uint32_t strongest,
                                 const std::function<void(double share)>& progress = {});

/// Writes compare.csv: the two metrics, the counts, the rate of disagreement, tau-b and the
/// strongest disagreement; a row a comparison, an empty field where there is none. Throws
/// std::system_error when writing fails.
void write_comparisons(int file, const DistanceTable& table,
                       const std::vector<Comparison>& comparisons);

}  // namespace merl::scan
