#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scan/statistics/bootstrap.h"
#include "scan/statistics/estimate.h"
#include "scan/votes/votes.h"

namespace merl::scan {

/// The level of significance of Ryman 2018.
inline constexpr double significance_level = 0.05;

/// With fewer judges there is no interval: Student's t of two judges is 12.7, and the interval
/// would have nearly all the room that there is.
inline constexpr std::uint32_t least_judges = 3;

/// How many votes were 1, 2 and 3, and how many are missing. With the sides undone (Ballot::side) 1
/// agrees with the first metric and 3 with the second.
struct OptionCounts {
    std::array<std::uint64_t, 3> votes{};
    std::uint64_t missing = 0;

    void add(std::uint8_t vote);
    std::uint64_t answered() const { return votes[0] + votes[1] + votes[2]; }
    double mean() const;  ///< of the votes; not a number without any
};

/// What the votes say about one configuration. p-values: uniform_test.h, one-sided, exact; not
/// numbers where nobody voted. Holm's correction is over all configurations of the same kind: those
/// without votes count, with a p-value of 1, for which hypotheses are tested is settled before the
/// votes.
struct ConfigurationVotes {
    std::uint32_t configuration;  ///< index in Votes::configurations
    OptionCounts sides;
    double p_first;  ///< for the first metric: the mean is as small by chance
    double p_first_holm;
    double p_second;  ///< for the second metric: as large by chance; the thesis' p-value
    double p_second_holm;
};

/// The quartiles of the response times in milliseconds (type 7, as numpy has them).
struct ResponseTimes {
    std::uint64_t count = 0;
    std::array<double, 3> quartiles{};
};

/// Trials of a kind that were answered, those that were as they should be, and the share of these
/// with its exact 95 % interval (Clopper and Pearson 1934).
struct Checks {
    std::uint64_t answered = 0;
    std::uint64_t passed = 0;
    std::uint64_t opposite = 0;  ///< of those that were not: the other side, not "equal"
    Estimate share() const;
};

/// Whether the votes lean to a side of the screen.
struct SideBias {
    OptionCounts shown;         ///< as on the screen
    std::uint64_t swapped = 0;  ///< answered trials with exchanged sides
    /// Exact sign test of left against right. Not a number where no sides were exchanged: then the
    /// left is always the first metric's side.
    double p_value;
};

/// The key that a judge pressed most often, as the screen has it: "left", "equal" or "right".
struct MostUsedKey {
    std::string_view key;
    std::uint64_t answers;
};

/// One judge. Sides are of the first looks at configurations of the selection.
struct JudgeVotes {
    OptionCounts sides;
    OptionCounts trials;  ///< all trials, as on the screen
    /// Most answers in a row, as they were shown, for the same side of the screen; "equal" between
    /// them counts neither way.
    std::uint64_t longest_run;
    SideBias bias;     ///< all but sentinels
    Checks repeats;    ///< the same answer, sides undone, as the first time
    Checks sentinels;  ///< the answer that both metrics give
    ResponseTimes times;
    std::vector<std::string> doubts;  ///< doubts.h

    MostUsedKey most_used() const;
};

/// How often judges chose the approximations of one label, or those of one label beside another.
struct ApproximationVotes {
    std::string label;
    std::string other;                     ///< empty: all others together
    std::uint64_t configurations = 0;      ///< with votes
    std::array<std::uint64_t, 3> votes{};  ///< more like the original: this one, equal, the other
    Estimate share;                        ///< of the votes for it, "equal" as half a vote
};

/// The votes on all configurations of one kind together, with intervals that take both
/// judges and materials as clusters (crossed_share.h), and where there are originals these alone:
/// an approximation has no votes but with its original.
struct OverallVotes {
    OptionCounts sides;
    std::array<Estimate, 3> shares;  ///< of the votes: first metric, equal, second metric
    Estimate lead;                   ///< share of the second minus share of the first
    /// Two-sided, that the lead is 0, and no less than the sign test of as many judges can give.
    /// Not a number where the lead has no interval.
    double p_value;
    std::uint64_t judges_first;  ///< judges with more votes for the first metric
    std::uint64_t judges_second;
    double judges_p;            ///< exact sign test of these
    std::uint64_t first_right;  ///< configurations with a majority for the first metric
    std::uint64_t second_right;
    /// Where there are originals: each label by itself, ascending, then every two with votes.
    std::vector<ApproximationVotes> approximations;
};

/// What the p-values of the configurations of the selection say together, at significance_level.
struct Significance {
    std::uint64_t configurations = 0;      ///< of the selection, with or without votes
    std::uint64_t judged = 0;              ///< those with votes
    std::array<std::uint64_t, 2> alone{};  ///< significant for the first and the second metric
    std::array<std::uint64_t, 2> holm{};   ///< the same with Holm's correction
    /// The fewest judges with whom a configuration can be significant with Holm's correction if 0,
    /// 1 and 2 of them say "equal" and all others the same (fewest_judges).
    std::array<std::optional<std::uint32_t>, 3> fewest_judges{};
    std::uint64_t most_votes = 0;  ///< on any configuration of the selection
    double least_p = 0;            ///< the smallest p-value that so many votes can have
    double least_p_needed = 0;     ///< what Holm's correction asks of the smallest p-value
};

/// What the votes of judges on one selection prove.
struct VoteStatistics {
    std::vector<ConfigurationVotes> configurations;  ///< selection and random, as in Votes
    Significance significance;
    std::vector<JudgeVotes> judges;
    OverallVotes selection;
    std::optional<OverallVotes> random;  ///< where there are random configurations
    Estimate alpha;                      ///< Krippendorff's, of the selection
    SideBias bias;
    Checks repeats;
    Checks sentinels;
    bool sentinels_known;  ///< whether the kit says what their answers should be
    ResponseTimes times;
};

/// All figures. The bootstrap is that of Krippendorff's alpha. Nothing depends on the number of
/// threads. `progress` is called with the share that is done; what it throws comes out.
VoteStatistics vote_statistics(const Votes& votes, const BootstrapOptions& options,
                               const std::function<void(double share)>& progress = {});

}  // namespace merl::scan
