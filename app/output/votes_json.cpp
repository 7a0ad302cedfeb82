#include "app/output/votes_json.h"

#include <string>

#include "app/output/json.h"
#include "engine/base/text.h"

namespace merl::app {
namespace {

using nlohmann::ordered_json;

ordered_json times(const scan::ResponseTimes& t) {
    return {
        {"count", t.count},
        {"quartiles",
         {figure_json(t.quartiles[0]), figure_json(t.quartiles[1]), figure_json(t.quartiles[2])}}};
}

ordered_json bias(const scan::SideBias& b) {
    return {{"left", b.shown.votes[0]},
            {"equal", b.shown.votes[1]},
            {"right", b.shown.votes[2]},
            {"swapped", b.swapped},
            {"p_value", figure_json(b.p_value)}};
}

ordered_json checks(const scan::Checks& c) {
    return {{"answered", c.answered},
            {"passed", c.passed},
            {"opposite", c.opposite},
            {"share", estimate_json(c.share())}};
}

ordered_json materials(const scan::FourMaterials& m) {
    return {{"left", {as_utf8(m[0]), as_utf8(m[1])}}, {"right", {as_utf8(m[2]), as_utf8(m[3])}}};
}

ordered_json approximations(const std::vector<scan::ApproximationVotes>& rows) {
    ordered_json list = ordered_json::array();
    for (const auto& row : rows) {
        list.push_back(
            {{"label", as_utf8(row.label)},
             {"other", row.other.empty() ? ordered_json() : ordered_json(as_utf8(row.other))},
             {"configurations", row.configurations},
             {"votes", row.votes},
             {"share", estimate_json(row.share)}});
    }
    return list;
}

ordered_json overall(const scan::OverallVotes& o) {
    ordered_json json = {
        {"votes", o.sides.votes},
        {"missing", o.sides.missing},
        {"shares",
         {estimate_json(o.shares[0]), estimate_json(o.shares[1]), estimate_json(o.shares[2])}},
        {"lead", estimate_json(o.lead)},
        {"p_value", figure_json(o.p_value)},
        {"judges", {o.judges_first, o.judges_second}},
        {"judges_p", figure_json(o.judges_p)},
        {"majorities", {o.first_right, o.second_right}}};
    if (!o.approximations.empty()) {
        json["approximations"] = approximations(o.approximations);
    }
    return json;
}

ordered_json configuration(const scan::Votes& votes, const scan::ConfigurationVotes& row) {
    const auto& c = votes.configurations[row.configuration];
    ordered_json json = {{"configuration", c.number}, {"kind", scan::kind_name(c.kind)}};
    json.update(materials(c.materials));
    json.update(
        ordered_json{{"agreement", c.agreement ? ordered_json(*c.agreement) : ordered_json()},
                     {"votes", row.sides.votes},
                     {"missing", row.sides.missing},
                     {"p_first", figure_json(row.p_first)},
                     {"p_first_holm", figure_json(row.p_first_holm)},
                     {"p_second", figure_json(row.p_second)},
                     {"p_second_holm", figure_json(row.p_second_holm)}});
    return json;
}

ordered_json significance(const scan::Significance& s) {
    ordered_json fewest = ordered_json::array();
    for (const auto& judges : s.fewest_judges) {
        if (s.configurations > 0) {
            fewest.push_back(judges ? ordered_json(*judges) : ordered_json());
        }
    }
    return {{"level", scan::significance_level},
            {"configurations", s.configurations},
            {"judged", s.judged},
            {"alone", s.alone},
            {"holm", s.holm},
            {"fewest_judges_by_equal_votes", fewest},
            {"most_votes", s.most_votes},
            {"least_p", s.least_p},
            {"least_p_needed", s.least_p_needed}};
}

ordered_json judge(const scan::Judge& who, const scan::JudgeVotes& j) {
    const auto most = j.most_used();
    const ordered_json key = {{"key", most.key}, {"answers", most.answers}};
    return {{"judge", as_utf8(who.name)},
            {"file", as_utf8(who.file)},
            {"missing", j.trials.missing},
            {"votes", j.sides.votes},
            {"side_bias", bias(j.bias)},
            {"repeats", checks(j.repeats)},
            {"sentinels", checks(j.sentinels)},
            {"response_ms", times(j.times)},
            {"most_used_key", key},
            {"longest_run", j.longest_run},
            {"looks_wrong", texts_json(j.doubts)}};
}

}  // namespace

ordered_json votes_json(const scan::Votes& votes, const scan::VoteStatistics& statistics) {
    ordered_json configurations = ordered_json::array();
    for (const auto& row : statistics.configurations) {
        configurations.push_back(configuration(votes, row));
    }
    ordered_json judges = ordered_json::array();
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        judges.push_back(judge(votes.judges[j], statistics.judges[j]));
    }
    return {
        {"metrics", {as_utf8(votes.first_metric), as_utf8(votes.second_metric)}},
        {"reference", votes.reference.empty() ? ordered_json() : ordered_json(votes.reference)},
        {"trials", votes.trials},
        {"selection", overall(statistics.selection)},
        {"random", statistics.random ? overall(*statistics.random) : ordered_json()},
        {"significance", significance(statistics.significance)},
        {"krippendorff_alpha", estimate_json(statistics.alpha)},
        {"side_bias", bias(statistics.bias)},
        {"repeats", checks(statistics.repeats)},
        {"sentinels", statistics.sentinels_known ? checks(statistics.sentinels) : ordered_json()},
        {"response_ms", times(statistics.times)},
        {"judges", judges},
        {"configurations", configurations}};
}

ordered_json exclusion_json(const scan::Votes& votes, const scan::Exclusion& exclusion) {
    ordered_json rules = ordered_json::array();
    for (const auto& rule : exclusion.rules) {
        const bool is_flag = rule.rule == scan::ExclusionRule::calibration_failed;
        rules.push_back({{"rule", scan::name_of(rule.rule)},
                         {"value", is_flag ? ordered_json(true) : ordered_json(rule.value)},
                         {"from", rule.of_kit ? "kit.json" : "--exclude"}});
    }
    ordered_json judges = ordered_json::array();
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        if (exclusion.is_excluded(j)) {
            ordered_json found = ordered_json::array();
            for (const auto& finding : exclusion.judges[j]) {
                found.push_back({{"rule", scan::name_of(finding.rule)}, {"found", finding.text}});
            }
            judges.push_back({{"judge", as_utf8(votes.judges[j].name)},
                              {"file", as_utf8(votes.judges[j].file)},
                              {"rules", found}});
        }
    }
    return {{"rules", rules},
            {"not_applied", texts_json(exclusion.not_applied)},
            {"not_assessed", texts_json(exclusion.not_assessed)},
            {"judges", judges}};
}

}  // namespace merl::app
