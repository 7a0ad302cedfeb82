#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {

/// Most answers of all judges together.
inline constexpr std::size_t max_answers = 1'000'000;

/// The header of a file of answers.
inline constexpr std::string_view survey_columns = "judge,question,answer";

/// What a judge answered to a question after the votes.
struct SurveyAnswer {
    std::string judge;
    std::string question;
    std::string answer;  ///< anything
};

/// Whether a text begins with the header of a file of answers.
bool is_survey(std::string_view text);

/// Reads answers from CSV (csv_reader.h) with the columns judge,question,answer and appends them.
/// Throws InputError.
void parse_survey(std::string_view text, const std::string& file,
                  std::vector<SurveyAnswer>& answers);

/// Drops what several saves of a judge's answers repeat: the same answer to a question again, and
/// no answer where there is one. Returns how many rows that were.
std::size_t drop_repeated_answers(std::vector<SurveyAnswer>& answers);

/// How many rows answer what a row of the same judge answers, too: several saves, between which the
/// judge has changed an answer. To be called when what is repeated has been dropped.
std::size_t contrary_answers(const std::vector<SurveyAnswer>& answers);

/// Writes the same columns; every text is csv_free_text. Throws std::system_error.
void write_survey(int file, const std::vector<SurveyAnswer>& answers);

}  // namespace merl::scan
