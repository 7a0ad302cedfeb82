#pragma once

#include <string>
#include <vector>

#include "scan/votes/kit_file.h"

namespace merl::app {

/// index.html of a kit, with its images: PNG files, [material][light], of the materials as
/// scan::shown_materials has them. Nothing in it says which metric is on which side, or what is
/// expected of a judge.
std::string judge_page(const scan::Kit& kit, const std::vector<std::vector<std::string>>& images);

}  // namespace merl::app
