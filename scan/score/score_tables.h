#pragma once

#include <string>

#include "scan/score/score.h"
#include "scan/statistics/estimate.h"

namespace merl::scan {

// The CSV tables of `score`, written as those of select/scan_tables.h are. Figures that are not
// determined are empty; infinite slopes are inf and -inf.

/// metric,majorities,majorities_low,majorities_high,votes,…,slope,…,log_likelihood_per_vote,…,
/// log_likelihood,ties,undecided,zero_distances,selected,fitted: one row a metric, in the order of
/// the score.
void write_scores(int file, const Score& score);

/// metric_1,metric_2,right_1,right_2,difference,difference_low,difference_high,clear_of_0,p_holm:
/// one row a pair of metrics.
void write_pair_scores(int file, const Score& score);

/// Appends a comma and the figure, and the same of both ends of its interval.
void append_estimate(std::string& out, const Estimate& estimate);

}  // namespace merl::scan
