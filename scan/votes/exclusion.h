#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/votes/exclusion_rules.h"
#include "scan/votes/vote_statistics.h"
#include "scan/votes/votes.h"

namespace merl::scan {

/// A rule that a judge falls under, and why.
struct Finding {
    ExclusionRule rule;
    std::string text;  ///< "3 of 5 sentinels failed"
};

/// What the rules say of every judge.
struct Exclusion {
    std::vector<StatedRule> rules;               ///< those that there are data for
    std::vector<std::string> not_applied = {};   ///< rules of the kit without data, and why
    std::vector<std::string> not_assessed = {};  ///< judges of whom a rule says nothing, and why
    std::vector<std::vector<Finding>> judges;    ///< as in Votes: what each falls under

    bool is_excluded(std::size_t judge) const { return !judges[judge].empty(); }
    std::size_t excluded() const;
};

/// Applies the rules. Throws InputError where there are no data for one of the command line.
Exclusion apply_rules(const Votes& votes, const VoteStatistics& statistics,
                      const std::vector<StatedRule>& rules);

/// The same experiment with the votes of the judges alone who fall under no rule.
Votes without_excluded(Votes votes, const Exclusion& exclusion);

}  // namespace merl::scan
