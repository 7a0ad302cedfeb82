#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "app/pipeline/control.h"
#include "engine/database/database.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"
#include "scan/pairs/listed_distances.h"
#include "scan/score/rating_score.h"
#include "scan/score/ratings.h"

namespace merl::pipeline {

/// How well each metric of a table predicts ratings of approximations.
struct RatingScoreResult {
    std::vector<std::uint64_t>
        refined;  // distances recomputed in float64, by metric; none of a table
    scan::RatingScore score;
    double refine_seconds = 0;
    double score_seconds = 0;
};

/// How well distances predict ratings, after those whose bounds leave open their place among all is
/// replaced in `table` by float64 ones: then every rank is that of float64. `database` and
/// `metrics` are those that the table was computed from; null and empty for one that was read;
/// `apart` is that of scan::score_ratings(); `memory_bytes` and `engines` (refine.h) are for
/// refining. The stages are
/// "refining" and "scoring". Throws what make_exact() (refine.h) and scan::score_ratings() throw,
/// and Cancelled.
RatingScoreResult score_ratings(scan::ListedDistances& table, const scan::Ratings& ratings,
                                std::optional<double> apart, const engine::Database* database,
                                std::span<const engine::Metric* const> metrics,
                                std::uint64_t memory_bytes = 1ULL << 30U,
                                const Control& control = {}, engine::Engines* engines = nullptr);

}  // namespace merl::pipeline
