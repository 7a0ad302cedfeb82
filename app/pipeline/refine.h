#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "engine/database/database.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"
#include "scan/pairs/distance_table.h"
#include "scan/pairs/listed_distances.h"
#include "scan/pairs/pairs.h"
#include "scan/score/judgements.h"
#include "scan/select/undecided.h"

namespace merl::pipeline {

/// Throws std::invalid_argument unless the table has the distances of these materials under these
/// metrics, in their order.
void require_source(const scan::DistanceTable& table, const engine::Database& database,
                    std::span<const engine::Metric* const> metrics);
void require_source(const scan::ListedDistances& table, const engine::Database& database,
                    std::span<const engine::Metric* const> metrics);

/// Whether distances under a metric that float32 leaves open can be refined: by its twin, or by a
/// device of these engines.
bool can_refine(const engine::Metric& metric, const engine::Engines* engines);

/// Whether all distances under it can be exact: if they can be refined, or are float64 already.
bool can_be_exact(const engine::Metric& metric, const engine::Engines* engines);

/// What refining took.
struct Refined {
    std::uint64_t first = 0;   // distances recomputed under the first metric
    std::uint64_t second = 0;  // under the second one
};

/// What refine() tells while it is at work; each may be empty, and may throw.
struct RefineProgress {
    std::function<void(double share)> deciding = {};           // which distances are wanted
    std::function<void(std::uint64_t distances)> wanted = {};  // so many, under both together
    std::function<void(double share)> refining = {};
};

/// Replaces, in float64, every distance on which what is to be decided rests and which its bound
/// leaves open, until nothing is left open: then the selection and, unless it is decided alone, the
/// count of disagreements are those of float64 (scan/select/undecided.h). Distances of a summary
/// are float64 already, and stay as they are. Samples, with what is asked for at
/// a time, stay within `memory_bytes` (float64_distances.h): however many are open, no bit changes.
/// `engines` refine metrics without a twin (Engines::float64_distances); null where there are none.
Refined refine(scan::Distances& distances, const engine::Database& database,
               const std::array<const engine::Metric*, 2>& metrics, std::uint32_t select,
               std::uint32_t per_material, std::uint64_t memory_bytes,
               const RefineProgress& progress,
               scan::Decided decided = scan::Decided::count_and_selection,
               engine::Engines* engines = nullptr);

/// Replaces, in float64, every distance that leaves the order of a judgement's two pairs open,
/// under each metric that can be refined: then what these predict is what float64 predicts. Returns
/// how many distances were replaced, by metric. Memory, `progress` and `engines` as above.
std::vector<std::uint64_t> refine_judged(scan::DistanceTable& table,
                                         const scan::Judgements& judgements,
                                         const engine::Database& database,
                                         std::span<const engine::Metric* const> metrics,
                                         std::uint64_t memory_bytes,
                                         const std::function<void(double)>& progress,
                                         engine::Engines* engines = nullptr);

/// Replaces distances under each metric, which go with the table's columns, in float64: those of
/// the entries listed for it, as places in `table.pairs`, ascending. None may be listed for a
/// summary, whose distances are float64 already, nor for another metric that cannot be refined.
/// Memory, `progress` and `engines` as above.
void make_exact(scan::ListedDistances& table, const engine::Database& database,
                std::span<const engine::Metric* const> metrics,
                std::span<const std::vector<std::uint32_t>> entries, std::uint64_t memory_bytes,
                const std::function<void(double)>& progress, engine::Engines* engines = nullptr);

}  // namespace merl::pipeline
