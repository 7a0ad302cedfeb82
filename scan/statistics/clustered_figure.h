#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scan/statistics/estimate.h"

namespace merl::scan {

/// A figure and what each cluster has done to it: the sum of the influences of its observations,
/// each the change of the figure, to first order, that the observation makes. An observation may be
/// in several clusters and counts in each.
struct ClusteredFigure {
    double value;
    std::vector<double> influences;
};

/// First minus second, of the same observations in the same clusters.
ClusteredFigure difference(const ClusteredFigure& first, const ClusteredFigure& second);

/// How many clusters of one size know as much of how clusters differ as these, which have so many
/// observations each: (sum of n)^2 / sum of n^2. 0 without observations.
double effective_clusters(std::span<const std::uint64_t> sizes);

/// The figure with the 95 % interval of Student's t distribution with G - 1 degrees of freedom and
/// the standard error sqrt(G / (G - 1) * sum of influences^2), where G > 1 is the effective number
/// of clusters. Without one for the reason given, if it is not empty, and where the figure is not
/// finite or no cluster differs from the others: that is no certainty, but the lack of anything
/// that could differ.
Estimate estimated(const ClusteredFigure& figure, double clusters, const std::string& reason = {});

/// The two-sided p-value of the same distribution that the figure is 0. Not a number where it has
/// no interval.
double p_of_zero(const ClusteredFigure& figure, double clusters, const std::string& reason = {});

}  // namespace merl::scan
