#pragma once

#include <string>

#include "scan/score/score.h"

namespace merl::app {

/// The metrics, best first, with what they predict: a dot and a 95 % interval for the majorities,
/// the votes and the log-likelihood, between chance and the ceiling. One SVG that needs nothing
/// else. `subtitle` says what was judged.
std::string score_svg(const scan::Score& score, const std::string& subtitle);

}  // namespace merl::app
