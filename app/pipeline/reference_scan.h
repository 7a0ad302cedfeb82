#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/pipeline/control.h"
#include "app/pipeline/scan.h"
#include "engine/database/database.h"
#include "engine/metric/metric.h"
#include "scan/pairs/agreement.h"
#include "scan/pairs/count.h"
#include "scan/pairs/listed_distances.h"
#include "scan/reference/approximations.h"
#include "scan/reference/reference_distances.h"
#include "scan/reference/reference_scan.h"
#include "scan/reference/reference_summary.h"

namespace merl::pipeline {

/// So many of the hardest originals are listed under each metric.
inline constexpr std::size_t kHardest = 5;

/// What metrics say of approximations of originals. Configurations hold places in the pairs of
/// `distances`.
struct ReferenceScanResult {
    scan::ReferenceDistances distances;  // refined
    std::vector<std::uint64_t> refined;  // distances recomputed, by metric
    bool exact = false;                  // whether nothing is left open under any metric
    std::vector<std::string> unbounded;  // the metrics whose float32 distances have no bound
    std::uint64_t undecided = 0;         // configurations that bounds leave open, before refining
    scan::Undecided left_open;           // and after it; of them kMostOpen or fewer are listed
    scan::Counts counts;                 // of configurations under the first two metrics
    std::vector<scan::Configuration> selection;
    std::vector<scan::Configuration> disagreements;  // that are listed
    std::optional<scan::Configuration> strongest;
    scan::ReferenceSummary summary;
    ScanSeconds seconds;
};

/// Which approximation each metric puts nearest to the original, and where the first two disagree
/// about two of them. Refines what float32 leaves open under any metric, counts, selects, lists and
/// sums up. The table has the pairs of the approximations and two metrics or more. `database` and
/// `metrics` are those that it was computed from, in its order; null and empty for one that was
/// read. Options, stages and errors are those of scan_distances() (scan.h); InputError where there
/// are more configurations than can be listed.
ReferenceScanResult scan_reference(scan::ListedDistances table, scan::Approximations approximations,
                                   const engine::Database* database,
                                   std::span<const engine::Metric* const> metrics,
                                   const ScanOptions& options = {}, const Control& control = {});

}  // namespace merl::pipeline
