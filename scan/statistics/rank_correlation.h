#pragma once

#include <span>
#include <vector>

namespace merl::scan {

/// A rank correlation, and what each observation does to it: the change of the figure, to first
/// order, when the observation weighs more (as in ClusteredFigure).
struct RankCorrelation {
    double value;  ///< not a number where one of the variables is the same everywhere
    std::vector<double> influences;
};

/// Spearman's: the correlation of the ranks of x and y, where equal ones have the mean of their
/// ranks. The influences include that an observation moves the ranks of others. Requires as many x
/// as y, all finite. O(n log n).
RankCorrelation spearman(std::span<const double> x, std::span<const double> y);

/// Kendall's tau-b: concordant minus discordant pairs of observations over the geometric mean of
/// the pairs that differ in x and of those that differ in y. Likewise.
RankCorrelation kendall(std::span<const double> x, std::span<const double> y);

}  // namespace merl::scan
