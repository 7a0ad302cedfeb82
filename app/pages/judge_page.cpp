#include "app/pages/judge_page.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <string_view>
#include <utility>

#include "app/pages/judge_page_html.h"
#include "app/pages/page.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// What the script of judge_page.html reads: materials by number.
ordered_json page_data(const scan::Kit& kit) {
    const auto materials = scan::shown_materials(kit);
    std::map<std::string_view, std::size_t> numbers;
    for (const auto& material : materials) {
        numbers.emplace(material, numbers.size());
    }
    const auto sides = [&](const scan::FourMaterials& m) -> ordered_json {
        return {{"left", {numbers.at(m[0]), numbers.at(m[1])}},
                {"right", {numbers.at(m[2]), numbers.at(m[3])}}};
    };
    ordered_json trials = ordered_json::array();
    for (const auto& trial : kit.trials) {
        trials.push_back(
            {{"configuration", trial.configuration}, {"kind", scan::kind_name(trial.kind)}});
        trials.back().update(sides(trial.materials));
    }
    return {{"kit_hash", kit.kit_hash},
            {"task", kit.reference.empty() ? "pairs" : "reference"},
            {"seed", kit.plan.seed},
            {"randomise", scan::lots_json(kit.lots)},
            {"background", kit.view.background},
            {"practice", sides(kit.practice)},
            {"trials", trials},
            {"materials", materials}};
}

}  // namespace

std::string judge_page(const scan::Kit& kit, const std::vector<std::vector<std::string>>& images) {
    auto list = ordered_json::array();
    for (const auto& lights : images) {
        auto& encoded = list.emplace_back(ordered_json::array());
        std::ranges::transform(lights, std::back_inserter(encoded), base64);
    }
    // The images first: nothing in base64 looks like the other place.
    auto page = filled_in(kJudgePage, "%IMAGES%", list.dump());
    return filled_in(std::move(page), "%DATA%", script_json(page_data(kit)));
}

}  // namespace merl::app
