#include "scan/votes/exclusion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace merl::scan {
namespace {

/// What a judge did, as far as a rule looks at it.
struct Assessed {
    bool falls_under = false;
    std::string text = {};     // what was found
    std::string nothing = {};  // why the rule says nothing of this judge
};

/// As a double the number that its decimal digits are: 7 of 100 is 0.07, where 0.07 * 100 is not 7.
double share(std::uint64_t part, std::uint64_t all) {
    return static_cast<double>(part) / static_cast<double>(all);
}

Assessed assess(const StatedRule& rule, const Judge& who, const JudgeVotes& judge) {
    switch (rule.rule) {
        case ExclusionRule::sentinels_failed: {
            const auto& checks = judge.sentinels;
            const auto failed = checks.answered - checks.passed;
            return {static_cast<double>(failed) >= rule.value,
                    fmt::format("{} of {} sentinels failed", failed, checks.answered),
                    checks.answered == 0 ? "answered no sentinel" : ""};
        }
        case ExclusionRule::repeats_below: {
            const auto& checks = judge.repeats;
            return {checks.answered > 0 && share(checks.passed, checks.answered) < rule.value,
                    fmt::format("{} of {} repeats answered as the first time", checks.passed,
                                checks.answered),
                    checks.answered == 0 ? "answered no repeat" : ""};
        }
        case ExclusionRule::median_time_below: {
            const double median = judge.times.quartiles[1] / 1000;
            return {judge.times.count > 0 && median < rule.value,
                    fmt::format("median response {:.3g} s", median),
                    judge.times.count == 0 ? "has no response times" : ""};
        }
        case ExclusionRule::same_key_above: {
            const auto most = judge.most_used();
            const auto answers = judge.trials.answered();
            return {
                answers > 0 && share(most.answers, answers) > rule.value,
                fmt::format("{} of {} answers with one key, {}", most.answers, answers, most.key),
                answers == 0 ? "has no answer" : ""};
        }
        case ExclusionRule::calibration_failed:
            break;
    }
    return {who.calibration_failed.value_or(false), "calibration failed",
            who.calibration_failed ? "" : "has no calibration"};
}

/// Why nothing can be said of any judge under this rule; empty where it can.
std::string why_no_data(ExclusionRule rule, const Votes& votes, const VoteStatistics& statistics) {
    const auto has_trials = [&](auto&& is_meant) {
        return std::ranges::any_of(votes.judges, [&](const Judge& judge) {
            return std::ranges::any_of(judge.ballots, is_meant);
        });
    };
    switch (rule) {
        case ExclusionRule::sentinels_failed:
            if (!statistics.sentinels_known) {
                return "what the answers of the sentinels are is in kit.json, to be given with "
                       "--kit";
            }
            return has_trials([&](const Ballot& b) {
                return votes.configurations[b.configuration].kind == TrialKind::sentinel;
            })
                       ? ""
                       : "there are no sentinels";
        case ExclusionRule::repeats_below:
            return has_trials([](const Ballot& b) { return b.repeat; }) ? ""
                                                                        : "there are no repeats";
        case ExclusionRule::median_time_below:
            return statistics.times.count > 0 ? "" : "no file has response times";
        case ExclusionRule::same_key_above:
            return has_trials([](const Ballot& b) { return b.swapped; })
                       ? ""
                       : "sides were never exchanged, so that one key is also what one metric says";
        case ExclusionRule::calibration_failed:
            break;
    }
    return std::ranges::any_of(
               votes.judges,
               [](const Judge& judge) { return judge.calibration_failed.has_value(); })
               ? ""
               : "no file has a calibration";
}

}  // namespace

std::size_t Exclusion::excluded() const {
    return static_cast<std::size_t>(
        std::ranges::count_if(judges, [](const auto& findings) { return !findings.empty(); }));
}

Exclusion apply_rules(const Votes& votes, const VoteStatistics& statistics,
                      const std::vector<StatedRule>& rules) {
    Exclusion result;
    result.judges.resize(votes.judges.size());
    for (const auto& rule : rules) {
        if (const auto why = why_no_data(rule.rule, votes, statistics); !why.empty()) {
            if (!rule.of_kit) {
                throw InputError(
                    fmt::format("--exclude {}: cannot be applied: {}", text_of(rule), why));
            }
            result.not_applied.push_back(fmt::format("{} of kit.json: {}", text_of(rule), why));
            continue;
        }
        result.rules.push_back(rule);
        for (std::size_t j = 0; j < votes.judges.size(); ++j) {
            const auto assessed = assess(rule, votes.judges[j], statistics.judges[j]);
            if (!assessed.nothing.empty()) {
                result.not_assessed.push_back(fmt::format("{} says nothing of {}, who {}",
                                                          text_of(rule), votes.judges[j].name,
                                                          assessed.nothing));
            } else if (assessed.falls_under) {
                result.judges[j].push_back({rule.rule, assessed.text});
            }
        }
    }
    return result;
}

Votes without_excluded(Votes votes, const Exclusion& exclusion) {
    std::vector<Judge> kept;
    for (std::size_t j = 0; j < votes.judges.size(); ++j) {
        if (!exclusion.is_excluded(j)) {
            kept.push_back(std::move(votes.judges[j]));
        }
    }
    votes.judges = std::move(kept);
    return votes;
}

}  // namespace merl::scan
