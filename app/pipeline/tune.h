#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "app/pipeline/control.h"
#include "app/pipeline/pair_distances.h"
#include "engine/database/database.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"
#include "scan/score/judgements.h"
#include "scan/tune/tune.h"

namespace merl::pipeline {

/// The parameters of a metric with these names, each once, in the order of the names; all that it
/// declares without names. Throws Error (usage) for a name that is not one of them or is there
/// twice, a metric without parameters, and a parameter whose range is one number.
std::vector<scan::TuneParameter> tune_parameters(const engine::Metric& metric,
                                                 std::span<const std::string> names);

/// So many evaluations of distances has a fit at most, unless it is said: of a summary of the
/// library, whose distances come from means in a fraction of a millisecond; and of any other
/// metric.
inline constexpr std::uint32_t quick_evaluations = 2000;
inline constexpr std::uint32_t slow_evaluations = 100;

/// What is known when the database was read once, before the search.
struct TuneBegin {
    DatabaseProvenance database;
    bool is_quick;                  // whether distances come from the means that were read
    std::uint64_t evaluations;      // of distances, at most; if not quick, one after the other
    double seconds_per_evaluation;  // if not quick
};

/// How long to search, from which random starts, and what it may take.
struct TuneOptions {
    std::optional<std::uint32_t> evaluations = {};  // of distances in one fit, at most
    std::uint64_t seed = 1;
    std::uint64_t memory_bytes = 1ULL << 30U;
    std::function<void(const TuneBegin&)> begin = {};  // called once; what it throws comes out
};

/// A metric fitted to judgements, and what that is worth.
struct TuneResult {
    engine::Metric metric;        // with the fitted parameters
    scan::Judgements judgements;  // on the materials of the database
    scan::Tuning tuning;
    bool from_means = false;             // whether distances came from means that were read once
    PairDistances distances;             // before and after, computed as for any other command
    std::vector<std::uint64_t> refined;  // of these, recomputed in float64
    std::vector<std::string> doubts;     // why not to believe it, one sentence each
    double reading_seconds = 0;          // of the means, or of one evaluation
    double fit_seconds = 0;
    double refine_seconds = 0;
};

/// Fits parameters of a metric to judgements (scan/tune/tune.h), from its own values on. Of a
/// summary every material is read once, and then once more for the distances before and after;
/// under another metric, or where windows depend on what is fitted, once for each evaluation.
/// `tuning.scores` are of the last, what float32 leaves open refined. The stages are "distances",
/// "fitting" and "refining". Throws what compute_pair_distances() and resolve_judgements() throw,
/// InputError where distances cannot be had under some values in the ranges, and Cancelled.
TuneResult tune(engine::Engines& engines, const engine::Database& database,
                const engine::Metric& metric, std::span<const scan::TuneParameter> parameters,
                const scan::JudgementFile& judgements, const TuneOptions& options = {},
                const Control& control = {});

}  // namespace merl::pipeline
