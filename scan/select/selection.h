#pragma once

#include <cstdint>
#include <vector>

#include "scan/pairs/agreement.h"
#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

/// The judge configurations (docs/file-formats.md): disagreements in the order of StrongerFirst,
/// taken greedily; one is skipped when one of its materials takes part in `per_material` chosen
/// ones already; at most `select`, in the order in which they were taken. A material in both pairs
/// of a configuration takes part once.
///
/// Searches best-first and lists no other disagreements: O(P log P) and little more. Throws
/// std::invalid_argument for bad distances.
std::vector<Configuration> select_configurations(const DistancesView& distances,
                                                 std::uint32_t select, std::uint32_t per_material,
                                                 const Progress& progress = {});

}  // namespace merl::scan
