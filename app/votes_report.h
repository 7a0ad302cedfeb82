#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "scan/survey_file.h"
#include "scan/votes.h"

namespace merl::app {

/// votes.html: one page that needs no other file and no network, with the votes per configuration,
/// p-values, agreement against votes, judges and survey. `summary` is votes_json with what else
/// summary.json has. `spheres` is a directory of images, MATERIAL.png, which become part of the
/// page; materials without one are shown by name. Empty: there are none. Throws scan::InputError
/// for an image that is none.
std::string votes_report(const nlohmann::ordered_json& summary, const scan::Votes& votes,
                         const std::vector<scan::SurveyAnswer>& survey, const std::string& spheres);

}  // namespace merl::app
