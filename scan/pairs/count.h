#pragma once

#include <cstdint>

#include "scan/pairs/pairs.h"
#include "scan/pairs/work.h"

namespace merl::scan {

/// How two metrics order all configurations; the five classes exclude each other and are the inputs
/// of Kendall's tau-b. Numbers are exact, so they do not depend on the number of threads.
struct Counts {
    std::uint64_t configurations = 0;
    std::uint64_t discordant = 0;        ///< ordered one way by one metric, the other by the other
    std::uint64_t tied_first_only = 0;   ///< tied in the first metric, not in the second
    std::uint64_t tied_second_only = 0;  ///< tied in the second metric, not in the first
    std::uint64_t tied_both = 0;

    std::uint64_t disagreements() const { return discordant + tied_first_only + tied_second_only; }
    std::uint64_t concordant() const { return configurations - disagreements() - tied_both; }
    /// Disagreements over configurations; 0 where there are none.
    double disagreement_rate() const {
        return configurations == 0
                   ? 0.0
                   : static_cast<double>(disagreements()) / static_cast<double>(configurations);
    }
    bool operator==(const Counts&) const = default;
};

/// Looks at every configuration once: O(P^2) comparisons, vectorised, on the threads of the
/// caller's arena. Throws std::invalid_argument for bad distances.
Counts count_by_streaming(const DistancesView& distances, const Progress& progress = {});

/// The same numbers without looking at configurations: sorts by the first metric and counts the
/// inversions of the second while merging (W. R. Knight, "A Computer Method for Calculating
/// Kendall's Tau with Ungrouped Data", JASA 61, 1966). O(P log P), on the threads of the caller's
/// arena; 24 bytes a pair. Throws std::invalid_argument for bad distances.
Counts count_by_inversions(const DistancesView& distances, const Progress& progress = {});

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
Census count_disagreements(const DistancesView& distances, const Progress& progress = {});

}  // namespace merl::scan
