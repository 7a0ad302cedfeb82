#include "scan/reference/approximations_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <tuple>

#include "engine/base/csv_reader.h"
#include "engine/base/number.h"

namespace merl::scan {
namespace {

/// Where the column of this name is. Fails unless there is one.
std::size_t column_of(const std::string& name, const std::vector<std::string>& header,
                      const CsvReader& reader) {
    const auto found = std::ranges::find(header, name);
    if (found == header.end() || std::ranges::count(header, name) > 1) {
        reader.fail(
            fmt::format("found {}; expected one \"{}\", as in the approximations.csv of "
                        "`merl-scan scan --reference`",
                        columns_text(header), name));
    }
    return static_cast<std::size_t>(found - header.begin());
}

}  // namespace

std::vector<ApproximationDistances> parse_approximations(std::string_view text,
                                                         const std::string& file,
                                                         const std::string& first_metric,
                                                         const std::string& second_metric) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    const auto column = [&](const std::string& name) { return column_of(name, header, reader); };
    const auto original = column("original");
    const auto approximation = column("approximation");
    const auto first = column(first_metric);
    const auto second = column(second_metric);
    std::vector<ApproximationDistances> rows;
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        const auto distance = [&](std::size_t i) {
            const auto value = reader.magnitude(fields[i]);
            if (!value) {
                reader.fail(
                    fmt::format("{}: found \"{}\"; expected a finite number, zero or more{}",
                                header[i], fields[i], reader.decimal_comma_hint(fields[i])));
            }
            return *value;
        };
        for (const auto i : {original, approximation}) {
            if (fields[i].empty()) {
                reader.fail(fmt::format("{}: found no name; expected one", header[i]));
            }
        }
        rows.push_back({.original = fields[original],
                        .approximation = fields[approximation],
                        .first = distance(first),
                        .second = distance(second)});
    }
    const auto key = [](const ApproximationDistances& row) {
        return std::tie(row.original, row.approximation);
    };
    std::ranges::sort(rows, {}, key);
    const auto twice = std::ranges::adjacent_find(rows, {}, key);
    if (twice != rows.end()) {
        throw InputError(fmt::format(R"({}: found "{}" of "{}" twice; expected a row of each)",
                                     file, twice->approximation, twice->original));
    }
    if (rows.empty()) {
        reader.fail("found no row after the header; expected an approximation");
    }
    return rows;
}

}  // namespace merl::scan
