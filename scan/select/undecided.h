#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

/// Pairs, ascending, whose distance must be known exactly before a decision stands.
struct Refinement {
    std::vector<std::uint32_t> first;   ///< under the first metric
    std::vector<std::uint32_t> second;  ///< under the second

    bool empty() const { return first.empty() && second.empty(); }
};

/// Which of some distances must be recomputed exactly before they are in order: every inexact one
/// whose interval [D - bound, D + bound] meets another one's; loose ones (agreement_doubts.h) come
/// first, and what still meets another one without them. O(n log n).
std::vector<bool> find_meeting(std::span<const double> values, std::span<const double> bounds);

/// What is to be as if all distances were exact.
enum class Decided {
    selection,            ///< with its order and all its numbers
    count_and_selection,  ///< and every sign of every configuration
};

/// What must be recomputed exactly so that every sign of every configuration, and the selection
/// with all its numbers and its order, are those of exact distances:
///
/// - for the signs, what find_meeting() finds under each metric: only those can be ordered
///   otherwise;
/// - both distances of every pair of the selection, and of the configurations that could, within
///   the bounds, be disagreements and come before one of the selected.
///
/// Where much is wanted for the signs, that is all at first: the selection is looked for with less
/// doubt when it is asked anew.
///
/// Exact distances (bound 0) are never asked for again, and final ones not at all. After they are
/// replaced the question is to be asked anew, for the selection may have changed; nothing is open
/// any more after few rounds. Throws std::invalid_argument for bad distances. O(P log P) and the
/// search of the selection; 30 bytes a pair.
Refinement to_refine(const Distances& distances, std::uint32_t select, std::uint32_t per_material,
                     Decided decided = Decided::count_and_selection, const Progress& progress = {});

/// Two pairs whose order the bounds leave open under a metric whose distances are final.
struct OpenConfiguration {
    std::uint32_t left;  ///< the earlier pair
    std::uint32_t right;
    std::string metric;

    bool operator==(const OpenConfiguration&) const = default;
};

/// At most so many of them, those under the first metric first, by ascending distance. One that is
/// open under both metrics is there twice. O(P log P + most), however many tie.
std::vector<OpenConfiguration> list_undecided(const Distances& distances, std::size_t most,
                                              const Progress& progress = {});

}  // namespace merl::scan
