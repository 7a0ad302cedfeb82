#pragma once

#include <span>
#include <string>

#include "scan/pairs/listed_distances.h"
#include "scan/score/rating_score.h"
#include "scan/score/ratings.h"

namespace merl::scan {

// The CSV tables of `score --ratings`, written as those of score_tables.h are.

/// What the name alone is called where metrics have their names.
inline constexpr const char* name_alone_text = "(name alone)";

/// original,approximation,ratings,rating,name_alone and a column per metric, its distance: one row
/// a rated approximation, in the order of the ratings.
void write_ratings(int file, const Ratings& ratings, const ListedDistances& table,
                   const RatingScore& score);

/// metric,spearman,spearman_low,spearman_high,kendall,…,pairs,…,pairs_apart,…,ties,undecided,fitted:
/// one row a metric, in the order of the score, then the name alone.
void write_rating_scores(int file, const RatingScore& score);

/// metric_1,metric_2, and of spearman, pairs and pairs_apart F,F_low,F_high,F_clear_of_0,F_p_holm:
/// one row a difference.
void write_rating_differences(int file, const RatingScore& score);

}  // namespace merl::scan
