#pragma once

#include <array>
#include <cstdint>

#include "scan/votes/votes.h"

namespace merl::scan {

/// `configurations` of four materials each out of `materials`, drawn by lot, and judges who have
/// not voted.
Votes empty_votes(std::uint32_t judges, std::uint32_t configurations, std::uint32_t materials,
                  std::uint32_t seed = 1);

/// The same of a reference kit: `configurations` of two approximations, of labels a to d, of one of
/// so many originals "o/m0", "o/m1" ..., by turns.
Votes empty_reference_votes(std::uint32_t judges, std::uint32_t configurations,
                            std::uint32_t originals, std::uint32_t seed = 1);

/// A vote with its sides undone, as the screen had it.
Ballot ballot(std::uint32_t configuration, int side, bool swapped = false, bool repeat = false);

/// Judges who answer by what they see: the sum of a mean, effects of judge, materials and
/// configuration, all normal with these standard deviations (the four materials together have
/// `material_effect`, and in a reference kit the original alone), and noise of standard
/// deviation 1. Above 0.3 they vote for the second metric, below -0.3 for the first.
struct SimulatedJudges {
    std::uint32_t judges = 12;
    std::uint32_t configurations = 60;
    std::uint32_t materials = 40;
    double judge_effect = 0;
    double material_effect = 0;
    double configuration_effect = 0;
    double mean = 0.5;
    double leaning = 0;      ///< to the left of the screen
    bool reference = false;  ///< the kit is one, and materials are originals

    Votes run(std::uint32_t seed) const;

    /// The expected shares of the votes over all judges, materials and configurations.
    std::array<double, 3> shares() const;
    double lead() const { return shares()[2] - shares()[0]; }
};

}  // namespace merl::scan
