#pragma once

#include <string>

#include "scan/votes/exclusion.h"
#include "scan/votes/vote_statistics.h"

namespace merl::scan {

// The CSV tables of `votes` (docs/file-formats.md has their columns). All write to an open file
// descriptor and throw std::system_error when writing fails. Texts of judges are csv_free_text.

/// configurations.csv: a row for each configuration of the selection, then for each random one.
/// `kept`: the same of the judges who are not excluded, in columns of their own; null where there
/// are no rules.
void write_configuration_votes(int file, const Votes& votes, const VoteStatistics& statistics,
                               const VoteStatistics* kept);

/// judges.csv: a row for each judge.
void write_judge_votes(int file, const Votes& votes, const VoteStatistics& statistics,
                       const Exclusion& exclusion);

/// judgements.csv: the votes added up as `score --judgements` reads them.
void write_judgements(int file, const Votes& votes, const VoteStatistics& statistics);

/// The table of the thesis, for people: how many configurations got which votes, with the p-value.
std::string thesis_table(const Votes& votes, const VoteStatistics& statistics);

}  // namespace merl::scan
