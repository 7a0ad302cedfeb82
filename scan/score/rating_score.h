#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "scan/pairs/listed_distances.h"
#include "scan/score/ratings.h"
#include "scan/statistics/estimate.h"

namespace merl::scan {

/// How well something that says which approximations are worse, a metric by its distances,
/// predicts ratings (docs/scoring.md has the definitions). 1 is the order of people.
struct RatingFigures {
    Estimate spearman;
    Estimate kendall;      ///< tau-b
    Estimate pairs;        ///< share of pairs of approximations of one original in people's order
    Estimate pairs_apart;  ///< the same of those whose ratings are further apart than stated
};

/// The figures of a metric.
struct MetricRatingScore {
    std::string name;
    RatingFigures figures;
    std::uint64_t ties;       ///< pairs, rated differently, whose distances are equal
    std::uint64_t undecided;  ///< approximations whose place among all the bounds leave open
    bool fitted = false;      ///< to these ratings, as its file says
};

/// What the name of an approximation alone predicts: the mean of its ratings with other originals.
struct NameScore {
    std::vector<double> predicted;  ///< of each rated approximation; not a number where it has none
    std::uint64_t approximations;   ///< that have one
    std::uint64_t originals;        ///< of these
    RatingFigures figures;          ///< on these alone; correlations are not determined
};

/// A difference of two figures, paired.
struct FigureDifference {
    Estimate estimate;
    double p_holm;  ///< that it is 0, adjusted for all rows of the table; not a number where there
                    ///< is no interval
};

/// A metric minus another one, or minus the name alone.
struct RatingDifference {
    std::uint32_t first;                  ///< index of the metric
    std::optional<std::uint32_t> second;  ///< none: the name alone
    FigureDifference spearman;
    FigureDifference pairs;
    FigureDifference pairs_apart;
};

/// What some of the figures rest on: intervals are by original.
struct RatingClusters {
    std::uint64_t observations = 0;  ///< approximations or pairs of them
    std::uint64_t originals = 0;     ///< that have one
    double effective = 0;            ///< the effective number of originals
    std::string too_few = {};        ///< why there are no intervals; else empty
};

/// How well metrics predict ratings, beside each other and beside the name alone.
struct RatingScore {
    double apart;                ///< pairs count as apart where ratings differ by more than this
    RatingClusters all;          ///< of correlations: approximations
    RatingClusters pairs;        ///< of those that are rated differently
    RatingClusters pairs_apart;  ///< of those that are apart
    std::uint64_t equal_pairs;   ///< that are rated the same, and left out
    std::uint64_t single_originals;  ///< with one rated approximation, so without a pair
    std::vector<MetricRatingScore> metrics;
    std::optional<NameScore> name_alone;        ///< none where no name is rated with two originals
    std::vector<RatingDifference> differences;  ///< (0,1), (0,2) ... (1,2) ..., then with the name
    std::vector<std::string> doubts;            ///< why not to believe it, one sentence each
};

/// The place of an approximation in `pairs` of a table. Throws std::invalid_argument where it has
/// no such pair.
std::size_t place_of(const ListedDistances& table, const RatedApproximation& rated);

/// The places in `pairs` of the table whose bounds leave open where a distance is among the others,
/// ascending; of a column that is final, not where distances are equal. Where a bound is infinite
/// there is no bound to speak of.
std::vector<std::uint32_t> open_places(const MetricColumn& column);

/// Scores the metrics of a table, which has all pairs of the ratings. Pairs are apart where their
/// ratings differ by more than `apart`, by default a tenth of the scale or, where none is stated,
/// of the range of the ratings. Nothing depends on the number of threads. `progress` is called with
/// the share that is done, from this thread; what it throws comes out.
RatingScore score_ratings(const Ratings& ratings, const ListedDistances& table,
                          std::optional<double> apart = std::nullopt,
                          const std::function<void(double share)>& progress = {});

/// Indices of the metrics by the share of pairs, best first; ties as they are.
std::vector<std::size_t> best_first(const RatingScore& score);

}  // namespace merl::scan
