#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/pipeline/control.h"
#include "app/pipeline/pair_distances.h"
#include "app/pipeline/refine.h"
#include "engine/database/database.h"
#include "engine/metric/metric.h"
#include "scan/pairs/agreement.h"
#include "scan/pairs/bounded_count.h"
#include "scan/pairs/count.h"
#include "scan/pairs/pairs.h"
#include "scan/select/undecided.h"

namespace merl::pipeline {

/// What is looked for among the configurations of two metrics, and what it may take.
struct ScanOptions {
    std::uint32_t select = 100;                  // configurations for judges
    std::uint32_t per_material = 10;             // in how many of them a material may take part
    std::optional<std::uint64_t> disagreements;  // how many to list, the strongest; without: all
                                                 // of them, which may be millions
    bool fast = false;                           // refine only what the selection rests on
    std::uint64_t memory_bytes = 1ULL << 30U;    // for refining

    /// Called before distances are refined, with how many and of how many; again where more follow
    /// from them. May throw.
    std::function<void(std::uint64_t distances, std::uint64_t of)> before_refining = {};
    engine::Engines* engines = nullptr;  // which refine metrics without a twin
};

/// Wall-clock seconds of the stages, which follow each other.
struct ScanSeconds {
    double refine = 0;
    double count = 0;
    double select = 0;
    double list = 0;
};

/// So many configurations that are left open are listed.
inline constexpr std::size_t kMostOpen = 1000;

/// Where two metrics disagree. Configurations hold places in the list of pairs of materials.
struct ScanResult {
    scan::Distances distances;  // refined
    Refined refined;
    bool exact = false;                  // whether nothing is left open
    bool selection_is_exact = false;     // whether the selection does not rest on any bound
    std::vector<std::string> unbounded;  // the metrics whose float32 distances have no bound
    std::uint64_t undecided = 0;         // configurations that bounds leave open, before refining
    std::uint64_t left_open = 0;         // and after it
    std::vector<scan::OpenConfiguration> open;  // of these, under a summary, the first kMostOpen
    scan::Census census;                        // of the distances as they are
    /// Between which numbers that of exact distances is; both are what was counted where nothing
    /// is left open.
    scan::BoundedCount bounded;
    std::vector<scan::Configuration> selection;      // for judges, in the order of being chosen
    std::vector<scan::Configuration> disagreements;  // that are listed
    std::optional<scan::Configuration> strongest;
    ScanSeconds seconds;
};

/// Where two metrics disagree: refines what float32 leaves open, counts, selects and lists. Takes
/// the first two metrics of the table. `database` and `metrics` are those that it was computed
/// from, in its order; null and empty for one that was read, or whose database is not there: then
/// nothing is refined. The stages are "counting" (bounds, too), "deciding" what to refine,
/// "refining", "selecting" and "listing". Takes up to 40 bytes a pair beside the distances, and 16
/// a disagreement that is listed. Throws what require_source() (refine.h) throws,
/// TooManyDisagreements as soon as it is known, what float64_distances() throws, and Cancelled.
ScanResult scan_distances(scan::DistanceTable table, const engine::Database* database,
                          std::span<const engine::Metric* const> metrics,
                          const ScanOptions& options = {}, const Control& control = {});

/// More disagreements are to be listed than can be.
class TooManyDisagreements : public Error {
  public:
    explicit TooManyDisagreements(const std::string& message) : Error(Fault::usage, message) {}
};

}  // namespace merl::pipeline
