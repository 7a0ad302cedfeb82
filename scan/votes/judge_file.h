#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"
#include "scan/votes/survey_file.h"
#include "scan/votes/vote_file.h"

namespace merl::scan {

/// Everything of one judge, as the page of a kit saves and sends it.
struct JudgeFile {
    VoteFile votes;
    std::vector<SurveyAnswer> survey;
};

/// Whether a text is one of these, which begin with a brace.
bool is_judge_file(std::string_view text);

/// Reads judge-JUDGE.json (docs/file-formats.md); keys that it does not need may hold anything.
/// Throws InputError.
JudgeFile parse_judge_file(std::string_view text, const std::string& file);

}  // namespace merl::scan
