#pragma once

#include <cstdint>

#include "scan/pairs/count.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {

/// Up to this many configurations (447 materials) are looked at one by one: one to two seconds on
/// two cores.
inline constexpr std::uint64_t max_streamed = 5'000'000'000;

/// What was counted, and how.
struct Census {
    Counts counts;
    bool streamed;  ///< false: too many configurations, counted by inversions only
};

/// Counts by inversions always and by streaming where there are no more than `max_streamed`
/// configurations. Throws std::logic_error when the two differ and std::invalid_argument for bad
/// distances.
Census count_disagreements(const Distances& distances);

}  // namespace merl::scan
