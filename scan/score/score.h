#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scan/score/judgements.h"
#include "scan/statistics/choice_model.h"
#include "scan/statistics/estimate.h"

namespace merl::scan {

/// A metric as `score` sees it.
struct ScoredMetric {
    std::string name;
    std::span<const double> distances;    ///< of every pair, in pair order; finite, zero or more
    std::span<const double> bounds = {};  ///< how far each can be from the exact one; empty: exact
    bool is_final = false;                ///< as in Distances: equal ones tie
};

/// How well one metric predicts the judgements (docs/scoring.md has the definitions).
struct MetricScore {
    std::string name;
    Estimate majorities;      ///< share of the untied majorities that it predicts
    Estimate votes;           ///< share of the votes that it predicts
    Estimate slope;           ///< of the choice model
    Estimate log_likelihood;  ///< of the choice model, per vote
    double total_log_likelihood;
    std::uint64_t ties;            ///< judgements whose two distances are equal
    std::uint64_t undecided;       ///< judgements whose order the bounds leave open
    std::uint64_t zero_distances;  ///< judgements with exactly one distance of 0
    bool selected = false;  ///< the judged configurations are where it disagrees with another one
    bool fitted = false;    ///< to these judgements, as its file says

    /// What it says is no likelier than chance. Where that is clear, people do the opposite.
    bool is_chance() const { return slope.value < 0; }
    bool is_opposed() const {
        return is_chance() && (slope.interval.high < 0 || std::isinf(slope.value));
    }
};

/// Who is right where two metrics predict different answers.
struct PairScore {
    std::uint32_t first;  ///< indices of the metrics
    std::uint32_t second;
    std::uint64_t first_right;  ///< untied majorities that the first predicts better
    std::uint64_t second_right;
    Estimate difference;  ///< majorities of the first minus majorities of the second
    double p_holm;  ///< that the difference is 0, adjusted for all pairs of metrics; not a number
                    ///< where the difference has no interval
};

/// What intervals rest on: all materials of a judgement are its clusters.
struct ScoreClusters {
    std::uint32_t materials;
    std::uint32_t references;         ///< materials that are the reference of a judgement
    std::uint64_t without_reference;  ///< judgements, each in the place of a reference
    std::uint32_t alternatives;       ///< materials that are anything else in one
    double effective;                 ///< the lesser of the effective numbers of both, by weight
    std::string too_few;              ///< why there are no intervals; else empty
};

/// How well metrics predict judgements; counts are of those on materials with distances.
struct Score {
    std::uint64_t judgements;
    std::uint64_t untied;
    std::uint64_t votes;
    std::uint64_t equal_votes;
    Estimate ceiling;                 ///< share of the votes that the best prediction gets
    Estimate ceiling_log_likelihood;  ///< per vote, of the observed shares of each judgement
    ScoreClusters clusters;  ///< of all votes; shares of majorities have those of majorities
    std::vector<MetricScore> metrics;
    std::vector<PairScore> pairs;  ///< (0,1), (0,2) ... (1,2) ...
};

/// The pairs of materials, ascending, whose inexact distances leave the order of a judgement's two
/// pairs open. Where a metric has an infinite bound there is no bound to speak of, and none is
/// listed. With exact distances in their place the order is known.
std::vector<std::uint32_t> open_pairs(const Judgements& judgements, const ScoredMetric& metric);

/// Scores every metric and every pair of metrics. Nothing depends on the number of threads.
/// `progress` is called with the share that is done, from this thread; what it throws comes out.
Score score(const Judgements& judgements, std::span<const ScoredMetric> metrics,
            const std::function<void(double share)>& progress = {});

/// With fewer materials intervals are too narrow (docs/scoring.md).
inline constexpr std::uint32_t fewest_score_materials = 10;
/// Likewise with a smaller effective number of references or others. Where there are 5, it is 5 if
/// all have as many judgements.
inline constexpr double fewest_effective_clusters = 4;

/// Gives metrics with a slope below 0 the likelihood of what they say, and not that of its
/// opposite: with a slope of 0 or more it is greatest at 0, which is chance.
void limit_to_own_order(Score& score);

/// What is predicted of one judgement.
struct Prediction {
    double prefers_left;    ///< 1: the left pair is the more alike; 0: the right one; 1/2: a tie
    double log_likelihood;  ///< of all its votes
};

/// What the choice model makes of judgements under distances of all pairs.
std::vector<Choice> choices_of(std::span<const Judgement> judgements,
                               std::span<const double> distances);

/// What distances and a slope predict. A slope below 0 counts as 0, which is chance: the prediction
/// is what the distances say, not its opposite.
std::vector<Prediction> predictions(std::span<const Judgement> judgements,
                                    std::span<const double> distances, double slope);

/// How well judgements are predicted, by whatever: figures as in MetricScore.
struct PredictionScore {
    Estimate majorities;
    Estimate votes;
    Estimate log_likelihood;  ///< per vote
};

/// Two predictions of the same judgements, and what the second has more than the first: paired.
struct PredictionScores {
    std::uint64_t judgements;
    std::uint64_t untied;
    std::uint64_t votes;
    ScoreClusters clusters;
    PredictionScore first;
    PredictionScore second;
    PredictionScore gain;
};

/// A prediction for each of the judgements.
PredictionScores score_predictions(const Judgements& judgements, std::span<const Prediction> first,
                                   std::span<const Prediction> second);

/// Indices of the metrics by the share of majorities, best first; ties as they are.
std::vector<std::size_t> best_first(const Score& score);

}  // namespace merl::scan
