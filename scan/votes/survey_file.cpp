#include "scan/votes/survey_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "engine/base/csv_reader.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/votes/judge_name.h"

namespace merl::scan {

namespace {

/// A judge and a question.
using Question = std::pair<std::wstring, std::string>;

Question question_of(const SurveyAnswer& answer) {
    return {judge_identity(answer.judge), answer.question};
}

bool has_survey_columns(const std::vector<std::string>& header) {
    return fmt::format("{}", fmt::join(header, ",")) == survey_columns;
}

}  // namespace

bool is_survey(std::string_view text) {
    try {
        return has_survey_columns(CsvReader(text, "").header());
    } catch (const InputError&) {
        return false;  // whoever reads it says what is wrong
    }
}

void parse_survey(std::string_view text, const std::string& file,
                  std::vector<SurveyAnswer>& answers) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    if (!has_survey_columns(header)) {
        reader.fail(
            fmt::format(R"(found {}; expected "{}")", columns_text(header), survey_columns));
    }
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (answers.size() == max_answers) {
            reader.fail(fmt::format("found more than {} answers", max_answers));
        }
        answers.push_back({fields[0], fields[1], fields[2]});
    }
}

std::size_t drop_repeated_answers(std::vector<SurveyAnswer>& answers) {
    std::set<Question> answered;
    for (const auto& answer : answers) {
        if (!answer.answer.empty()) {
            answered.insert(question_of(answer));
        }
    }
    std::set<std::pair<Question, std::string>> seen;
    return std::erase_if(answers, [&](const SurveyAnswer& answer) {
        const auto question = question_of(answer);
        const bool better = answer.answer.empty() && answered.contains(question);
        return better || !seen.emplace(question, answer.answer).second;
    });
}

std::size_t contrary_answers(const std::vector<SurveyAnswer>& answers) {
    std::set<Question> questions;
    for (const auto& answer : answers) {
        questions.insert(question_of(answer));
    }
    return answers.size() - questions.size();
}

void write_survey(int file, const std::vector<SurveyAnswer>& answers) {
    std::string text = fmt::format("{}\n", survey_columns);
    for (const auto& [judge, question, answer] : answers) {
        text += fmt::format("{},{},{}\n", csv_free_text(judge), csv_free_text(question),
                            csv_free_text(answer));
    }
    write_all(file, text);
}

}  // namespace merl::scan
