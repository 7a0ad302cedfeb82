#include "app/pages/judge_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <string_view>
#include <utility>

#include "app/pages/judge_page_html.h"
#include "app/pages/judge_study_js.h"
#include "app/pages/page.h"
#include "engine/base/error.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

/// What the script of judge_page.html reads: materials by number.
ordered_json page_data(const scan::Kit& kit, const Study& study) {
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
    ordered_json practice = ordered_json::array({sides(kit.practice)});
    std::ranges::transform(kit.more_practice, std::back_inserter(practice), sides);
    auto settings = study.settings;
    // Whoever knows the rules could keep to them.
    settings.erase("exclusion");
    settings.erase("texts");
    return {{"kit_hash", kit.kit_hash},
            {"task", kit.reference.empty() ? "pairs" : "reference"},
            {"seed", kit.plan.seed},
            {"randomise", scan::lots_json(kit.lots)},
            {"background", kit.view.background},
            {"size", kit.view.size},
            {"practice", practice},
            {"trials", trials},
            {"materials", materials},
            {"post", kit.post},
            {"study_hash", kit.study_hash},
            {"study", settings},
            {"texts", judge_texts(study, !kit.reference.empty())}};
}

}  // namespace

std::string origin_of(const std::string& address) {
    // The origin goes into the policy of the page, where blanks, commas and semicolons mean other
    // things, and which has no place for an address of IPv6.
    static const std::regex pattern(
        R"((https?://[A-Za-z0-9](?:[A-Za-z0-9.-]*[A-Za-z0-9])?(?::([0-9]{1,5}))?)(?:/[!$&-;=?-Z_a-z~%]*)?)",
        std::regex::icase);
    std::smatch parts;
    constexpr int kMostPort = 65535;
    if (address.size() > 2000 || !std::regex_match(address, parts, pattern) ||
        (parts[2].matched && std::stoi(parts[2]) > kMostPort)) {
        throw Error(
            Fault::usage,
            fmt::format("--post {}: expected an address that begins with http:// or "
                        "https:// and has neither a user, a fragment nor an address of IPv6",
                        address));
    }
    std::string origin = parts[1];
    std::ranges::transform(origin, origin.begin(),
                           [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    return origin;
}

std::string judge_page(const scan::Kit& kit, const Study& study,
                       const std::vector<std::vector<std::string>>& images) {
    auto list = ordered_json::array();
    for (const auto& lights : images) {
        auto& encoded = list.emplace_back(ordered_json::array());
        std::ranges::transform(lights, std::back_inserter(encoded), base64);
    }
    auto page = filled_in(kJudgePage, "%CONNECT%",
                          kit.post.empty() ? "" : "; connect-src " + origin_of(kit.post));
    page = filled_in(std::move(page), "%STUDY%", kJudgeStudyScript);
    // The data last: nothing in base64 looks like another place.
    page = filled_in(std::move(page), "%IMAGES%", list.dump());
    return filled_in(std::move(page), "%DATA%", script_json(page_data(kit, study)));
}

}  // namespace merl::app
