#include "scan/survey_file.h"

#include <fmt/format.h>

#include "scan/csv.h"
#include "scan/csv_reader.h"

namespace merl::scan {
namespace {

const std::vector<std::string> survey_header = {"judge", "question", "answer"};

}  // namespace

void parse_survey(std::string_view text, const std::string& file,
                  std::vector<SurveyAnswer>& answers) {
    CsvReader reader(text, file);
    std::vector<std::string> fields;
    if (!reader.next(fields) || fields != survey_header) {
        reader.fail("expected the columns judge,question,answer");
    }
    while (reader.next(fields)) {
        if (fields.size() != survey_header.size()) {
            reader.fail(fmt::format("found {} fields; expected {}, as in the header", fields.size(),
                                    survey_header.size()));
        }
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
