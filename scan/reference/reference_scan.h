#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/count.h"
#include "scan/reference/reference_distances.h"
#include "scan/select/undecided.h"

namespace merl::scan {

// A scan of originals and approximations. A configuration is two approximations of one original,
// each beside it: which is more like the original? Indices of pairs are those of the table, which
// ascend in pair order; agreement and total order are those of every scan (agreement.h). All of it
// looks at every configuration: O(k^2) for k approximations of an original.

/// How two metrics, by index, order the configurations.
Counts count_configurations(const ReferenceDistances& distances, std::size_t first,
                            std::size_t second);

/// Every disagreement of the first two metrics, in the order of StrongerFirst.
std::vector<Configuration> disagreements_of(const ReferenceDistances& distances);

/// Of all disagreements in order the configurations for judges, as select_configurations()
/// (selection.h) takes them. An original takes part once in each of its configurations, as each of
/// the two approximations does.
std::vector<Configuration> select_of(const ReferenceDistances& distances,
                                     const std::vector<Configuration>& disagreements,
                                     std::uint32_t select, std::uint32_t per_material);

/// What must be recomputed exactly, pairs by metric, ascending, so that the rank of every
/// approximation under every metric, the hardest originals (reference_summary.h) and the selection
/// with all its numbers and its order are those of exact distances. As to_refine() (undecided.h):
/// exact and final distances, and those of metrics that cannot be refined, are not asked for, and
/// once what was is exact the question is to be asked anew. Throws std::invalid_argument without
/// bounds.
std::vector<std::vector<std::uint32_t>> to_refine(const ReferenceDistances& distances,
                                                  const std::vector<bool>& can_be_refined,
                                                  std::uint32_t select, std::uint32_t per_material);

/// Configurations that the bounds leave open.
struct Undecided {
    std::uint64_t configurations = 0;     ///< under at least one of the metrics
    std::vector<OpenConfiguration> open;  ///< of those under final distances, the first ones: by
                                          ///< metric, then original
};

/// Finds them and lists `most` or fewer.
Undecided find_undecided(const ReferenceDistances& distances, std::size_t most);

}  // namespace merl::scan
