#pragma once

#include <nlohmann/json.hpp>

#include "scan/votes/exclusion.h"
#include "scan/votes/vote_statistics.h"

namespace merl::app {

/// All figures of the votes, as summary.json has them (docs/file-formats.md).
nlohmann::ordered_json votes_json(const scan::Votes& votes, const scan::VoteStatistics& statistics);

/// What the rules of exclusion say: which there are, and who falls under which.
nlohmann::ordered_json exclusion_json(const scan::Votes& votes, const scan::Exclusion& exclusion);

}  // namespace merl::app
