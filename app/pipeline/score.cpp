#include "app/pipeline/score.h"

#include "app/pipeline/refine.h"
#include "engine/base/stopwatch.h"

namespace merl::pipeline {

ScoreResult score_distances(scan::DistanceTable& table, const scan::JudgementFile& judgements,
                            const engine::Database* database,
                            std::span<const engine::Metric* const> metrics,
                            std::uint64_t memory_bytes, const Control& control,
                            engine::Engines* engines) {
    ScoreResult result;
    Stopwatch watch;
    result.judgements = scan::resolve_judgements(judgements, table.names);
    if (database != nullptr) {
        require_source(table, *database, metrics);
        result.refined = refine_judged(table, result.judgements, *database, metrics, memory_bytes,
                                       control.stage("refining"), engines);
    }
    result.refine_seconds = watch.lap();
    std::vector<scan::ScoredMetric> scored;
    for (const auto& column : table.metrics) {
        scored.push_back({column.metric, column.values, column.bounds, column.is_final});
    }
    result.score = scan::score(result.judgements, scored, control.stage("scoring"));
    scan::limit_to_own_order(result.score);
    result.score_seconds = watch.lap();
    return result;
}

}  // namespace merl::pipeline
