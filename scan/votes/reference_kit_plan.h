#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/reference/approximations_file.h"
#include "scan/select/selection_file.h"
#include "scan/votes/kit_plan.h"

namespace merl::scan {

// The plan of a kit whose judges say which of two approximations looks more like the original
// (`scan --reference`), beside that for pairs (kit_plan.h).

/// Throws InputError that names the row, unless every row of the selection has an original of this
/// label first on both sides, and approximations of it by other labels.
void expect_reference(const SelectionFile& selection, const std::string& reference);

/// Throws InputError, calling the approximations `file`, unless they have those of the selection at
/// the same distances.
void expect_same_scan(const SelectionFile& selection,
                      const std::vector<ApproximationDistances>& approximations,
                      const std::string& file);

/// How many of so many approximations are among the farthest that sentinels are drawn from: 2 %, at
/// least 20, and no more than half.
std::size_t sentinel_approximations(std::size_t approximations);

/// The trials of a kit, as plan_kit has them, but:
///
/// - A sentinel has the original itself on one side and on the other one of its approximations that
///   is among the farthest under both metrics (sentinel_approximations), drawn by lot, the side
///   too; no original is in two sentinels. The original is more like itself, whatever metrics say.
/// - Random disagreements are of two approximations of one original.
///
/// `approximations` are those of the whole scan, as parse_approximations has them; they may be
/// empty where neither is asked for.
std::vector<KitTrial> plan_reference_kit(const SelectionFile& selection,
                                         const std::vector<ApproximationDistances>& approximations,
                                         const KitPlan& plan);

/// What judges practise on: the last original of the selection, on the left itself, and on the
/// right the first approximation of another original, so that nobody can be wrong about what is
/// meant. Where there is no other, an approximation of its own.
FourMaterials reference_practice(const SelectionFile& selection);

}  // namespace merl::scan
