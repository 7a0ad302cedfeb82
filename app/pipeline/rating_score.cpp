#include "app/pipeline/rating_score.h"

#include "app/pipeline/refine.h"
#include "engine/base/stopwatch.h"

namespace merl::pipeline {

RatingScoreResult score_ratings(scan::ListedDistances& table, const scan::Ratings& ratings,
                                std::optional<double> apart, const engine::Database* database,
                                std::span<const engine::Metric* const> metrics,
                                std::uint64_t memory_bytes, const Control& control,
                                engine::Engines* engines) {
    RatingScoreResult result;
    Stopwatch watch;
    if (database != nullptr) {
        require_source(table, *database, metrics);
        std::vector<std::vector<std::uint32_t>> open(metrics.size());
        for (std::size_t m = 0; m < metrics.size(); ++m) {
            if (can_refine(*metrics[m], engines)) {
                open[m] = scan::open_places(table.metrics[m]);
            }
            result.refined.push_back(open[m].size());
        }
        make_exact(table, *database, metrics, open, memory_bytes, control.stage("refining"),
                   engines);
    }
    result.refine_seconds = watch.lap();
    result.score = scan::score_ratings(ratings, table, apart, control.stage("scoring"));
    result.score_seconds = watch.lap();
    return result;
}

}  // namespace merl::pipeline
