#pragma once

#include <string>
#include <vector>

#include "scan/votes/vote_statistics.h"
#include "scan/votes/votes.h"

namespace merl::scan {

/// Above this probability of as many right answers by lot a judge cannot be told from lots.
inline constexpr double doubt_of_sentinels = 0.05;

/// Below this probability by lot a leaning to one side of the screen, or a run of one key, is none
/// of what was to be seen.
inline constexpr double doubt_of_sides = 0.001;

/// What looks wrong about a judge, a sentence each (docs/experiment.md); whatever the rules of
/// exclusion are. Answers by lot: each as often "equal" as this judge's, the others left or right
/// with the same chance, which is what sides exchanged by lot make of any answer that does not
/// depend on what is seen.
std::vector<std::string> doubts_about(const Votes& votes, const JudgeVotes& judge,
                                      bool sentinels_known);

}  // namespace merl::scan
