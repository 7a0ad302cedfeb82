#include "scan/score/judgement_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <utility>

#include "engine/base/csv_reader.h"
#include "engine/base/text.h"
#include "scan/io/input.h"
#include "scan/pairs/material_numbers.h"
#include "scan/score/lagunas.h"

namespace merl::scan {
namespace {

/// Rows between two calls of progress.
constexpr std::uint64_t rows_per_update = 4096;

const std::vector<std::string> reference_header = {"reference", "a", "b", "votes_a", "votes_b"};
const std::vector<std::string> configuration_header = {
    "left_1", "left_2", "right_1", "right_2", "votes_left", "votes_equal", "votes_right"};

std::uint64_t parse_votes(const std::string& text, const std::string& column, CsvReader& reader) {
    const auto votes = reader.whole_number(text);
    if (!votes || *votes > max_votes) {
        reader.fail(fmt::format("{}: found \"{}\"; expected a whole number from 0 to {}", column,
                                text, max_votes));
    }
    return *votes;
}

/// Turns the fields of a row into votes; knows what the columns are called.
class RowReader {
  public:
    RowReader(CsvReader& reader, const std::vector<std::string>& header)
        : reader_(reader), header_(header) {}

    NamedVotes read(const std::vector<std::string>& fields) {
        return &header_ == &reference_header ? read_reference(fields) : read_configuration(fields);
    }

    const std::vector<std::string>& names() const { return materials_.names(); }

  private:
    NamedVotes read_reference(const std::vector<std::string>& fields) {
        const auto [reference, a, b] =
            std::array{material(fields, 0), material(fields, 1), material(fields, 2)};
        expect_different(fields, 0, 1);
        expect_different(fields, 0, 2);
        expect_different(fields, 1, 2);
        return {reference, a, reference, b, votes(fields, 3), 0, votes(fields, 4)};
    }

    NamedVotes read_configuration(const std::vector<std::string>& fields) {
        const NamedVotes row = {material(fields, 0), material(fields, 1), material(fields, 2),
                                material(fields, 3), votes(fields, 4),    votes(fields, 5),
                                votes(fields, 6)};
        expect_different(fields, 0, 1);
        expect_different(fields, 2, 3);
        if (std::minmax(row.left_1, row.left_2) == std::minmax(row.right_1, row.right_2)) {
            reader_.fail(fmt::format(R"(found "{}" and "{}" on both sides; expected two pairs)",
                                     fields[0], fields[1]));
        }
        return row;
    }

    std::uint32_t material(const std::vector<std::string>& fields, std::size_t column) {
        if (fields[column].empty()) {
            reader_.fail(fmt::format("{}: found a material without a name", header_[column]));
        }
        return materials_.number(fields[column], reader_);
    }

    std::uint64_t votes(const std::vector<std::string>& fields, std::size_t column) {
        return parse_votes(fields[column], header_[column], reader_);
    }

    void expect_different(const std::vector<std::string>& fields, std::size_t one,
                          std::size_t other) const {
        if (fields[one] == fields[other]) {
            reader_.fail(fmt::format("found \"{}\" as {} and {}; expected different materials",
                                     fields[one], header_[one], header_[other]));
        }
    }

    CsvReader& reader_;
    const std::vector<std::string>& header_;
    MaterialNumbers materials_;
};

JudgementFile parse_csv(std::string_view text, const std::string& file,
                        const std::function<void(double share)>& progress) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    if (header != reference_header && header != configuration_header) {
        reader.fail(fmt::format(R"(found {}; expected "{}" or "{}")", columns_text(header),
                                fmt::join(reference_header, ","),
                                fmt::join(configuration_header, ",")));
    }
    const bool with_reference = header == reference_header;
    RowReader rows(reader, with_reference ? reference_header : configuration_header);
    JudgementFile result = {file, with_reference ? "reference CSV" : "configuration CSV", {}, {}};
    // Growing would take three times as much.
    result.rows.reserve(std::min(reader.most_rows(), max_judgement_rows));
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (result.rows.size() == max_judgement_rows) {
            reader.fail(fmt::format("found more than {} rows", max_judgement_rows));
        }
        result.rows.push_back(rows.read(fields));
        if (progress && result.rows.size() % rows_per_update == 0) {
            progress(reader.share());
        }
    }
    if (result.rows.empty()) {
        reader.fail("found no row after the header; expected a judgement");
    }
    result.names = rows.names();
    return result;
}

}  // namespace

JudgementFile parse_judgements(std::string_view text, const std::string& file,
                               std::span<const std::string> indexed_names,
                               const std::function<void(double share)>& progress) {
    const std::string_view content = without_byte_order_mark(text);
    const auto begin = content.find_first_not_of(" \t\r\n");
    const bool is_json = begin != std::string_view::npos && content[begin] == '{';
    return is_json ? parse_lagunas(content, file, indexed_names) : parse_csv(text, file, progress);
}

}  // namespace merl::scan
