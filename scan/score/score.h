#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scan/score/judgements.h"
#include "scan/statistics/bootstrap.h"
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
};

/// Who is right where two metrics predict different answers.
struct PairScore {
    std::uint32_t first;  ///< indices of the metrics
    std::uint32_t second;
    std::uint64_t first_right;  ///< untied majorities that the first predicts better
    std::uint64_t second_right;
    double p_value;       ///< exact two-sided sign test; not a number with too few clusters
    double p_holm;        ///< the same, adjusted for all pairs of metrics
    Estimate difference;  ///< majorities of the first minus majorities of the second
};

struct Score {
    std::uint64_t judgements;
    std::uint64_t untied;
    std::uint64_t votes;
    std::uint64_t equal_votes;
    Estimate ceiling;                 ///< share of the votes that the best prediction gets
    Estimate ceiling_log_likelihood;  ///< per vote, of the observed shares of each judgement
    std::string too_few;  ///< why the clusters are too few for intervals and p-values; else empty
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
            const BootstrapOptions& options,
            const std::function<void(double share)>& progress = {});

/// Indices of the metrics by the share of majorities, best first; ties as they are.
std::vector<std::size_t> best_first(const Score& score);

}  // namespace merl::scan
