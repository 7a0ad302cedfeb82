#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace merl::app {

/// index.html of a kit: `data` is what the script of judge_page.html reads, but for the images,
/// which are put in as files of PNG, [material][light].
std::string judge_page(const nlohmann::ordered_json& data,
                       const std::vector<std::vector<std::string>>& images);

}  // namespace merl::app
