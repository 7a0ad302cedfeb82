#include "scan/select/selection_file.h"

#include <fmt/format.h>

#include <optional>

#include "engine/base/csv_reader.h"
#include "scan/io/input.h"

namespace merl::scan {
namespace {

constexpr std::size_t columns = 10;
constexpr std::size_t distances = 5;  // where they begin

/// The metric of two columns NAME_left and NAME_right; none if they are something else.
std::optional<std::string> metric_of(const std::string& left, const std::string& right) {
    constexpr std::string_view end = "_left";
    if (left.size() <= end.size() || !left.ends_with(end)) {
        return std::nullopt;
    }
    std::string metric = left.substr(0, left.size() - end.size());
    return right == metric + "_right" ? std::optional(metric) : std::nullopt;
}

void read_header(CsvReader& reader, SelectionFile& selection) {
    const auto header = reader.header();
    const std::vector<std::string> fixed = {"rank", "left_1", "left_2", "right_1", "right_2"};
    if (header.size() == columns && header.back() == "agreement" &&
        std::equal(fixed.begin(), fixed.end(), header.begin())) {
        const auto first = metric_of(header[distances], header[distances + 1]);
        const auto second = metric_of(header[distances + 2], header[distances + 3]);
        if (first && second) {
            selection.first_metric = *first;
            selection.second_metric = *second;
            return;
        }
    }
    reader.fail(fmt::format(
        "found {}; expected the {} of selection.csv, "
        "\"rank,left_1,left_2,right_1,right_2,D1_left,D1_right,D2_left,D2_right,agreement\" with "
        "the names of two metrics for D1 and D2",
        columns_text(header), columns));
}

double number(const std::string& text, CsvReader& reader) {
    const auto value = reader.magnitude(text);
    if (!value) {
        reader.fail(fmt::format("found \"{}\"; expected a finite number, zero or more{}", text,
                                reader.decimal_comma_hint(text)));
    }
    return *value;
}

}  // namespace

SelectionFile parse_selection(std::string_view text, const std::string& file) {
    CsvReader reader(text, file);
    SelectionFile selection{
        .file = file, .first_metric = {}, .second_metric = {}, .configurations = {}};
    read_header(reader, selection);
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        const auto rank = selection.configurations.size() + 1;
        if (reader.whole_number(fields[0]) != rank) {
            reader.fail(fmt::format("rank: found \"{}\"; expected {}", fields[0], rank));
        }
        if (selection.configurations.size() == max_trials) {
            reader.fail(fmt::format("found more than {} configurations", max_trials));
        }
        const auto value = [&](std::size_t i) { return number(fields[distances + i], reader); };
        const SelectedConfiguration row{.materials = {fields[1], fields[2], fields[3], fields[4]},
                                        .first = {value(0), value(1)},
                                        .second = {value(2), value(3)},
                                        .agreement = value(4)};
        if (const auto fault = fault_of(row.materials); !fault.empty()) {
            reader.fail(fault);
        }
        if (row.first[0] > row.first[1] || row.second[0] < row.second[1] ||
            (row.first[0] == row.first[1] && row.second[0] == row.second[1])) {
            reader.fail(
                fmt::format("found a configuration on which the metrics do not disagree; "
                            "expected the left pair to be the smaller under {} and the "
                            "larger under {}",
                            selection.first_metric, selection.second_metric));
        }
        selection.configurations.push_back(row);
    }
    if (selection.configurations.empty()) {
        reader.fail("found no row after the header; expected a configuration to judge");
    }
    return selection;
}

}  // namespace merl::scan
