#pragma once

#include <string>
#include <vector>

#include "app/pages/judge_study.h"
#include "scan/votes/kit_file.h"

namespace merl::app {

/// The origin of an address that pages may send answers to, http or https: "https://host:port", in
/// small letters. Throws Error (usage) for anything else.
std::string origin_of(const std::string& address);

/// index.html of a kit, with its images: PNG files, [material][light], of the materials as
/// scan::shown_materials has them. Nothing in it says which metric is on which side, or what is
/// expected of a judge.
std::string judge_page(const scan::Kit& kit, const Study& study,
                       const std::vector<std::vector<std::string>>& images);

}  // namespace merl::app
