#include "scan/votes/survey_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <utility>

#include "engine/base/csv_reader.h"
#include "engine/base/text.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/votes/judge_name.h"

namespace merl::scan {

bool is_survey(std::string_view text) {
    text = without_byte_order_mark(text);
    const auto rest = text.substr(std::min(survey_columns.size(), text.size()));
    return text.starts_with(survey_columns) &&
           (rest.empty() || rest.front() == '\n' || rest.front() == '\r');
}

void parse_survey(std::string_view text, const std::string& file,
                  std::vector<SurveyAnswer>& answers) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    if (fmt::format("{}", fmt::join(header, ",")) != survey_columns) {
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
    using Question = std::pair<std::wstring, std::string>;
    const auto question_of = [](const SurveyAnswer& answer) {
        return Question(judge_identity(answer.judge), answer.question);
    };
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

void write_survey(int file, const std::vector<SurveyAnswer>& answers) {
    std::string text = fmt::format("{}\n", survey_columns);
    for (const auto& [judge, question, answer] : answers) {
        text += fmt::format("{},{},{}\n", csv_free_text(judge), csv_free_text(question),
                            csv_free_text(answer));
    }
    write_all(file, text);
}

}  // namespace merl::scan
