#include "app/pages/judge_page.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "app/pages/judge_page_html.h"
#include "app/pages/page.h"

namespace merl::app {

std::string judge_page(const nlohmann::ordered_json& data,
                       const std::vector<std::vector<std::string>>& images) {
    auto list = nlohmann::ordered_json::array();
    for (const auto& lights : images) {
        auto& encoded = list.emplace_back(nlohmann::ordered_json::array());
        std::ranges::transform(lights, std::back_inserter(encoded), base64);
    }
    // The images first: nothing in base64 looks like the other place.
    auto page = filled_in(kJudgePage, "%IMAGES%", list.dump());
    return filled_in(std::move(page), "%DATA%", script_json(data));
}

}  // namespace merl::app
