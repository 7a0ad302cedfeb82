#pragma once

#include <cstdint>

#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

/// What bounds on the errors of distances leave of the number of disagreements.
struct BoundedCount {
    std::uint64_t least = 0;      ///< disagreements whose signs the bounds decide
    std::uint64_t undecided = 0;  ///< configurations of which a sign is open

    /// An undecided configuration may be a disagreement or not, whatever is known of it.
    std::uint64_t greatest() const { return least + undecided; }
    bool operator==(const BoundedCount&) const = default;
};

/// How many disagreements exact distances have. The order of two distances is decided where their
/// intervals [D - bound, D + bound] do not meet, and where both are exact (or final) and equal: a
/// tie. Whatever the exact distances within the intervals, the number of their disagreements is
/// between `least` and `greatest()`; where all are exact they are the same. O(P log P), whatever
/// meets, and 32 bytes a pair. Throws std::invalid_argument for bad distances.
BoundedCount bound_disagreements(const DistancesView& distances, const Progress& progress = {});

/// Configurations whose sign the bounds cannot decide under at least one metric.
inline std::uint64_t count_undecided(const DistancesView& distances,
                                     const Progress& progress = {}) {
    return bound_disagreements(distances, progress).undecided;
}

}  // namespace merl::scan
