#include "scan/votes/exclusion_rules.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "engine/base/number.h"

namespace merl::scan {
namespace {

/// A rule, and what its value may be.
struct KnownRule {
    ExclusionRule rule;
    std::string_view name;
    std::string_view expected;
};

constexpr std::array<KnownRule, 5> known_rules = {{
    {ExclusionRule::sentinels_failed, "sentinels_failed", "a whole number from 1 to 1000000"},
    {ExclusionRule::repeats_below, "repeats_below", "a fraction above 0, up to 1"},
    {ExclusionRule::median_time_below, "median_time_below",
     "a number of seconds above 0, up to 3600"},
    {ExclusionRule::same_key_above, "same_key_above", "a fraction from 0, below 1"},
    {ExclusionRule::calibration_failed, "calibration_failed", "true or false"},
}};

const KnownRule* find_rule(std::string_view name) {
    const auto* const found = std::ranges::find(known_rules, name, &KnownRule::name);
    return found == known_rules.end() ? nullptr : found;
}

std::string all_names() {
    std::vector<std::string_view> names;
    std::ranges::transform(known_rules, std::back_inserter(names), &KnownRule::name);
    return fmt::format("{}", fmt::join(names, ", "));
}

/// Whether a rule can have this number as its value.
bool allows(ExclusionRule rule, double value) {
    switch (rule) {
        case ExclusionRule::sentinels_failed:
            return value >= 1 && value <= 1e6 && value == std::floor(value);
        case ExclusionRule::repeats_below:
            return value > 0 && value <= 1;
        case ExclusionRule::median_time_below:
            return value > 0 && value <= 3600;
        case ExclusionRule::same_key_above:
            return value >= 0 && value < 1;
        case ExclusionRule::calibration_failed:
            break;
    }
    return false;
}

std::string value_text(ExclusionRule rule, double value) {
    return rule == ExclusionRule::calibration_failed ? (value != 0 ? "true" : "false")
                                                     : fmt::format("{}", value);
}

}  // namespace

std::string_view name_of(ExclusionRule rule) {
    return std::ranges::find(known_rules, rule, &KnownRule::rule)->name;
}

std::string text_of(const StatedRule& rule) {
    return fmt::format("{}={}", name_of(rule.rule), value_text(rule.rule, rule.value));
}

StatedRule parse_rule(std::string_view text) {
    const auto fail = [&](std::string_view expected) {
        throw Error(Fault::usage,
                    fmt::format("--exclude: found \"{}\"; expected {}", text, expected));
    };
    const auto equals = text.find('=');
    const auto* const known = find_rule(text.substr(0, equals));
    if (known == nullptr || equals == std::string_view::npos) {
        fail(fmt::format("RULE=VALUE with one of the rules {}", all_names()));
    }
    const auto value = text.substr(equals + 1);
    if (known->rule == ExclusionRule::calibration_failed) {
        if (value != "true" && value != "false") {
            fail(fmt::format("{} as the value", known->expected));
        }
        return {known->rule, value == "true" ? 1.0 : 0.0};
    }
    const auto number = parse_finite(value);
    if (!number || !allows(known->rule, *number)) {
        fail(fmt::format("{} as the value", known->expected));
    }
    return {known->rule, *number};
}

std::vector<StatedRule> parse_rules(const nlohmann::json& object, const std::string& place) {
    if (!object.is_object()) {
        throw InputError(fmt::format("{}: expected an object", place));
    }
    std::vector<StatedRule> rules;
    for (const auto& [key, value] : object.items()) {
        const auto* const known = find_rule(key);
        if (known == nullptr) {
            throw InputError(fmt::format("{}: found the rule \"{}\"; expected one of {}", place,
                                         key, all_names()));
        }
        const bool is_flag = known->rule == ExclusionRule::calibration_failed;
        if (is_flag ? !value.is_boolean()
                    : !value.is_number() || !allows(known->rule, value.get<double>())) {
            throw InputError(
                fmt::format("{}, {}: found {}; expected {}", place, key,
                            value.dump(-1, ' ', true, nlohmann::json::error_handler_t::replace),
                            known->expected));
        }
        if (!is_flag || value.get<bool>()) {
            rules.push_back({known->rule, is_flag ? 1.0 : value.get<double>(), true});
        }
    }
    return rules;
}

std::vector<StatedRule> merge_rules(std::vector<StatedRule> of_kit,
                                    const std::vector<StatedRule>& of_command_line) {
    std::vector<StatedRule> rules = std::move(of_kit);
    for (const auto& rule : of_command_line) {
        if (std::ranges::count(of_command_line, rule.rule, &StatedRule::rule) > 1) {
            throw Error(Fault::usage, fmt::format("--exclude: found {} twice; expected it once",
                                                  name_of(rule.rule)));
        }
        std::erase_if(rules, [&](const StatedRule& other) { return other.rule == rule.rule; });
        if (rule.rule != ExclusionRule::calibration_failed || rule.value != 0) {
            rules.push_back(rule);
        }
    }
    std::ranges::sort(rules, {}, &StatedRule::rule);
    return rules;
}

}  // namespace merl::scan
