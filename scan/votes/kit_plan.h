#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/pairs/pairs.h"
#include "scan/select/selection_file.h"
#include "scan/votes/vote_file.h"

namespace merl::scan {

/// What judges are shown beside the selection.
struct KitPlan {
    std::uint64_t seed = 1;
    double repeats = 10;          ///< in percent of the selection, rounded up
    std::uint32_t sentinels = 5;  ///< at most
    std::uint32_t random = 10;    ///< at most
    bool operator==(const KitPlan&) const = default;
};

/// A trial of every judge, on the sides of the selection; each judge sees it on sides and in an
/// order of their own.
struct KitTrial {
    std::uint64_t configuration;  ///< row of the selection from 1; beyond it, those that are added
    TrialKind kind;
    FourMaterials materials;
    std::uint8_t expected = 0;        ///< of a sentinel: 1 left or 3 right, what both metrics say
    std::optional<double> agreement;  ///< of a disagreement
    bool operator==(const KitTrial&) const = default;
};

/// Throws InputError, calling the distances `file`, unless they have every pair of the selection
/// with the same distances under the same metrics.
void expect_same_scan(const SelectionFile& selection, const Distances& distances,
                      const std::string& file);

/// How many of so many pairs are among the closest, and among the farthest, that sentinels are
/// drawn from: 2 %, at least 20, and no more than there are.
std::size_t sentinel_pairs(std::size_t pairs);

/// The trials of a kit: the selection in its order, then sentinels, disagreements drawn by lot, and
/// repeats. The same for the same seed on every machine.
///
/// - A sentinel has on one side a pair that is among the closest under both metrics and on the
///   other one that is among the farthest under both (sentinel_pairs), drawn by lot, the side too;
///   no material is in two sentinels.
/// - Disagreements are drawn with equal chances from all that are not in the selection; fewer than
///   asked for where ten million drawn configurations did not have as many.
/// - Repeats are rows of the selection, drawn by lot, each at most once.
///
/// Sentinels and random disagreements need `distances`, which may be null where none are asked for.
std::vector<KitTrial> plan_kit(const SelectionFile& selection, const Distances* distances,
                               const KitPlan& plan);

/// The trials of the selection, in its order: what every plan begins with.
std::vector<KitTrial> selection_trials(const SelectionFile& selection);

/// Adds the repeats, with which every plan ends, to trials that begin with those of the selection.
void add_repeats(std::vector<KitTrial>& trials, const KitPlan& plan);

/// What judges practise on, which does not count: the last configuration of the selection with a
/// left side that does not change. One side changes, the other does not: nobody can be wrong about
/// what is meant.
FourMaterials practice_of(const SelectionFile& selection);

}  // namespace merl::scan
