#include "scan/survey_file.h"

#include <fmt/format.h>

#include <algorithm>

#include "scan/csv.h"
#include "scan/csv_reader.h"

namespace merl::scan {
namespace {

const std::vector<std::string> survey_header = {"judge", "question", "answer"};

}  // namespace

void parse_survey(std::string_view text, const std::string& file,
                  std::vector<SurveyAnswer>& answers) {
    CsvReader reader(text, file);
    if (auto header = reader.header(); header != survey_header) {
        header.resize(std::min<std::size_t>(header.size(), 8));
        reader.fail(fmt::format(R"(found the columns "{}"; expected "{}")", fmt::join(header, ","),
                                fmt::join(survey_header, ",")));
    }
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        answers.push_back({fields[0], fields[1], fields[2]});
    }
}

void write_survey(int file, const std::vector<SurveyAnswer>& answers) {
    std::string text = "judge,question,answer\n";
    for (const auto& [judge, question, answer] : answers) {
        text += fmt::format("{},{},{}\n", csv_free_text(judge), csv_free_text(question),
                            csv_free_text(answer));
    }
    write_all(file, text);
}

}  // namespace merl::scan
