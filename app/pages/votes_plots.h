#pragma once

#include <string>
#include <vector>

#include "scan/votes/survey_file.h"
#include "scan/votes/vote_statistics.h"
#include "scan/votes/votes.h"

namespace merl::app {

/// A picture of votes.html, for a wide window and for a narrow one.
struct VotesPlot {
    std::string name;  ///< of its file, without an ending
    std::string wide;  ///< SVG
    std::string narrow;
};

/// The pictures of the votes: "judgement-summary" (figure 5.2 of Ryman 2018), "shares", "p-values"
/// and "agreement"; then one of each question of the survey with answers that can be counted,
/// "survey-QUESTION" (figures 6.1 to 6.4), which names no judge. `of` stands after their titles, to
/// say whose votes they are; empty: everybody's.
std::vector<VotesPlot> votes_plots(const scan::Votes& votes, const scan::VoteStatistics& statistics,
                                   const std::vector<scan::SurveyAnswer>& survey,
                                   const std::string& of = {});

}  // namespace merl::app
