#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "scan/pairs/count.h"
#include "scan/reference/reference_distances.h"

namespace merl::scan {

/// The rank of each approximation (of Approximations::list) among those of its original under a
/// metric: 1 for the smallest distance; those that tie share the mean of their ranks.
std::vector<double> ranks_of(const ReferenceDistances& distances, std::size_t metric);

/// The approximations of a label under a metric, of the complete originals.
struct LabelFigures {
    std::optional<double> mean_rank;  ///< none where no original is complete
    std::uint64_t best = 0;           ///< how often no other is nearer
    std::uint64_t tied_best = 0;      ///< in how many of these another one is as near
};

/// An original under a metric: how far even its best approximation is.
struct Hardness {
    std::uint32_t original;  ///< an index into names
    std::uint32_t label;     ///< of the best approximation; the first of those that tie
    double distance;
    bool operator==(const Hardness&) const = default;
};

/// What a metric says of the approximations.
struct MetricFigures {
    std::vector<LabelFigures> labels;  ///< in the order of Approximations::labels
    std::vector<Hardness> hardest;     ///< complete originals by descending distance, then name
};

/// Two metrics beside each other.
struct MetricPair {
    std::size_t first;  ///< indices of metrics
    std::size_t second;
    Counts counts;                ///< of configurations
    std::uint64_t different = 0;  ///< originals none of whose approximations is best under both
    std::uint64_t partly = 0;     ///< originals of which some but not all of the best are, by ties
};

/// A scan of originals in figures.
struct ReferenceSummary {
    std::uint64_t complete = 0;  ///< originals that all labels approximate
    std::uint64_t contested =
        0;  ///< originals with two approximations or more: those of MetricPair
    std::vector<MetricFigures> metrics;
    std::vector<MetricPair> pairs;  ///< (0,1), (0,2) ... (1,2) ...
};

/// Lists `hardest` originals a metric or fewer.
ReferenceSummary summarise(const ReferenceDistances& distances, std::size_t hardest);

}  // namespace merl::scan
