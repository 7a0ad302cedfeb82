#include "scan/votes/doubts.h"

#include <fmt/format.h>

#include <algorithm>

#include "scan/statistics/lots.h"

namespace merl::scan {
namespace {

/// From this share of "equal" on a judge has hardly compared anything.
constexpr double kNearlyAll = 0.9;

/// Seconds in which nobody has seen what was to be compared: the second material of a side comes
/// after one, and of three spheres at once the page takes no answer earlier. A study has its own.
constexpr double kSecondsOfPairs = 1;
constexpr double kSecondsOfOriginals = 0.45;

/// Right answers to sentinels, of a judge who may have answered by lot.
void doubt_sentinels(const Checks& checks, double equal, std::vector<std::string>& doubts) {
    const double p = at_least_by_lot(checks.answered, checks.passed, (1 - equal) / 2);
    if (checks.answered >= checks.passed + 2 && p > doubt_of_sentinels) {
        doubts.push_back(
            fmt::format("failed {} of {} sentinels: answers by lot fail as few with p {:.2g}",
                        checks.answered - checks.passed, checks.answered, p));
    }
}

/// Answers to repeats: by lot both are "equal", or both on the same side.
void doubt_repeats(const Checks& checks, double equal, std::vector<std::string>& doubts) {
    const double alike = equal * equal + (1 - equal) * (1 - equal) / 2;
    const double expected = alike * static_cast<double>(checks.answered);
    if (checks.answered < 2 || static_cast<double>(checks.passed) > expected) {
        return;
    }
    const double fewer = at_most_by_lot(checks.answered, checks.passed, alike);
    doubts.push_back(fmt::format(
        "answered {} of {} repeats as the first time: answers by lot {:.1f} on average, {} with p "
        "{:.2g}",
        checks.passed, checks.answered, expected,
        fewer <= doubt_of_sentinels ? "so few" : "as many or more",
        fewer <= doubt_of_sentinels ? fewer
                                    : at_least_by_lot(checks.answered, checks.passed, alike)));
}

void doubt_sides(const JudgeVotes& judge, std::vector<std::string>& doubts) {
    const auto& shown = judge.bias.shown.votes;
    const auto most = std::max(shown[0], shown[2]);
    if (judge.bias.p_value < doubt_of_sides) {
        doubts.push_back(fmt::format("answered {} {} of {} times: by lot p {:.2g}",
                                     shown[0] > shown[2] ? "left" : "right", most,
                                     shown[0] + shown[2], judge.bias.p_value));
    }
    // A run is no news of a judge who leans to that side anyhow.
    const double p = run_by_lot(judge.trials.votes[0] + judge.trials.votes[2], judge.longest_run);
    if (judge.bias.swapped > 0 && p < doubt_of_sides && judge.bias.p_value >= doubt_of_sides) {
        doubts.push_back(fmt::format("answered the same side {} times in a row: by lot p {:.2g}",
                                     judge.longest_run, p));
    }
}

}  // namespace

std::vector<std::string> doubts_about(const Votes& votes, const JudgeVotes& judge,
                                      bool sentinels_known) {
    std::vector<std::string> doubts;
    const auto answers = judge.trials.answered();
    if (answers == 0) {
        return doubts;
    }
    const double equal = static_cast<double>(judge.trials.votes[1]) / static_cast<double>(answers);
    // Without an exchange of sides one key is also what one metric says, and lots know nothing.
    const bool by_lot = judge.bias.swapped > 0;
    if (sentinels_known && by_lot) {
        doubt_sentinels(judge.sentinels, equal, doubts);
    }
    if (by_lot) {
        doubt_repeats(judge.repeats, equal, doubts);
        doubt_sides(judge, doubts);
    }
    if (answers >= 10 && equal >= kNearlyAll) {
        doubts.push_back(
            fmt::format("answered \"equal\" to {} of {}", judge.trials.votes[1], answers));
    }
    const double least = votes.seconds_to_see.value_or(
        votes.reference.empty() ? kSecondsOfPairs : kSecondsOfOriginals);
    if (judge.times.count > 0 && judge.times.quartiles[1] < 1000 * least) {
        doubts.push_back(
            fmt::format("has a median response of {:.2g} s, in which {} cannot have been seen",
                        judge.times.quartiles[1] / 1000,
                        votes.reference.empty() ? "both materials of a side" : "three spheres"));
    }
    return doubts;
}

}  // namespace merl::scan
