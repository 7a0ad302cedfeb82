#pragma once

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {

/// What a judge is called careless for.
enum class ExclusionRule : std::uint8_t {
    sentinels_failed,    ///< so many sentinels failed, or more
    repeats_below,       ///< a smaller share of the repeats answered as the first time
    median_time_below,   ///< a shorter median response time, in seconds
    same_key_above,      ///< a larger share of the answers given with one key
    calibration_failed,  ///< 1: whose screen was found not to be as the study needs it
};

/// "sentinels_failed" ...
std::string_view name_of(ExclusionRule rule);

/// A rule as it was stated before the votes were looked at.
struct StatedRule {
    ExclusionRule rule;
    double value;
    bool of_kit = false;  ///< in kit.json, not on the command line
    bool operator==(const StatedRule&) const = default;
};

/// "sentinels_failed=2".
std::string text_of(const StatedRule& rule);

/// Reads RULE=VALUE. Throws Error (usage).
StatedRule parse_rule(std::string_view text);

/// Reads what kit.json and a study file have as "exclusion": an object with any of the rules as
/// keys. `place` is what errors call it. calibration_failed: false states no rule. Throws
/// InputError.
std::vector<StatedRule> parse_rules(const nlohmann::json& object, const std::string& place);

/// Those of the kit, but of a rule that is in both lists the one of the command line. Throws Error
/// (usage) where that has a rule twice.
std::vector<StatedRule> merge_rules(std::vector<StatedRule> of_kit,
                                    const std::vector<StatedRule>& of_command_line);

}  // namespace merl::scan
