#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "app/pipeline/control.h"
#include "app/pipeline/pair_distances.h"
#include "engine/database/database.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"
#include "scan/score/judgements.h"
#include "scan/score/score.h"

namespace merl::pipeline {

/// How well each metric of a table predicts judgements, and every two beside each other.
struct ScoreResult {
    scan::Judgements judgements;  // on the materials of the table
    std::vector<std::uint64_t>
        refined;  // distances recomputed in float64, by metric; none of a table
    scan::Score score;
    double refine_seconds = 0;
    double score_seconds = 0;
};

/// How well distances predict judgements, after what float32 leaves open of that is refined in
/// `table`. `database` and `metrics` are those that the table was computed from; null and empty for
/// one that was read; `memory_bytes` and `engines` (refine.h) are for refining. The stages are
/// "refining" and "scoring". Throws what require_source() (refine.h), resolve_judgements(),
/// float64_distances() and scan::score() throw, and Cancelled.
ScoreResult score_distances(scan::DistanceTable& table, const scan::JudgementFile& judgements,
                            const engine::Database* database,
                            std::span<const engine::Metric* const> metrics,
                            std::uint64_t memory_bytes = 1ULL << 30U, const Control& control = {},
                            engine::Engines* engines = nullptr);

}  // namespace merl::pipeline
