#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/pages/votes_plots.h"
#include "engine/base/error.h"
#include "scan/votes/survey_file.h"
#include "scan/votes/votes.h"

namespace merl::app {

/// The images MATERIAL.png in the directory `spheres`, as votes_report() embeds them; none if that
/// is empty. What they say that they show must be what `material_hashes` has for their material;
/// `warnings` gets a line if some do not say it. Throws InputError for an image that is none
/// or shows something else.
nlohmann::ordered_json sphere_images(const scan::Votes& votes, const std::string& spheres,
                                     const std::map<std::string, std::string>& material_hashes,
                                     std::vector<std::string>& warnings);

/// votes.html: one page that needs no other file and no network, with the votes per configuration,
/// p-values, agreement against votes, judges and survey. `summary` is votes_json with what else
/// summary.json has. Materials without an image are shown by name. `plots` are of all judges, and
/// `kept_plots` without the excluded ones, if there are any.
std::string votes_report(const nlohmann::ordered_json& summary,
                         const std::vector<scan::SurveyAnswer>& survey,
                         const nlohmann::ordered_json& images, const std::vector<VotesPlot>& plots,
                         const std::vector<VotesPlot>& kept_plots);

}  // namespace merl::app
