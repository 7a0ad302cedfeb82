#pragma once

#include <cstdint>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

/// The most disagreements that `all_disagreements` lists: 4 GiB of memory.
inline constexpr std::uint64_t max_listed = std::uint64_t{1} << 28;

/// Every disagreement, in the order of StrongerFirst. O(P^2) comparisons and a sort, on the threads
/// of the caller's arena; 16 bytes each. Throws std::invalid_argument for bad distances and
/// std::length_error for more than `max_listed` disagreements. `progress` is called on this thread
/// with about the share that is done; what it throws comes out.
std::vector<Configuration> all_disagreements(const Distances& distances,
                                             const Progress& progress = {});

/// The first `count` of them, or all where there are no more. A few are searched for without
/// listing the others; many are cut from the list. Errors as above, but std::length_error only when
/// more than `max_listed` are to be returned.
std::vector<Configuration> strongest_disagreements(const Distances& distances, std::uint64_t count,
                                                   const Progress& progress = {});

}  // namespace merl::scan
