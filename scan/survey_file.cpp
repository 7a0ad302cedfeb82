#include "scan/survey_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "scan/csv.h"
#include "scan/csv_reader.h"

namespace merl::scan {

void parse_survey(std::string_view text, const std::string& file,
                  std::vector<SurveyAnswer>& answers) {
    CsvReader reader(text, file);
    auto header = reader.header();
    header.resize(std::min<std::size_t>(header.size(), 8));
    const auto columns = fmt::format("{}", fmt::join(header, ","));
    if (columns != survey_columns) {
        reader.fail(
            fmt::format(R"(found the columns "{}"; expected "{}")", columns, survey_columns));
    }
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (answers.size() == max_answers) {
            reader.fail(fmt::format("found more than {} answers", max_answers));
        }
        answers.push_back({fields[0], fields[1], fields[2]});
    }
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
