#include "scan/pairs/distance_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "engine/base/csv_reader.h"
#include "engine/base/error.h"
#include "engine/base/number.h"
#include "scan/io/csv.h"
#include "scan/io/input.h"
#include "scan/pairs/material_numbers.h"

namespace merl::scan {
namespace {

/// Rows between two calls of progress.
constexpr std::uint64_t kRowsPerUpdate = 4096;

/// A row whose materials are numbered as they first occurred.
struct Row {
    std::uint32_t a;
    std::uint32_t b;
    std::uint64_t line;
};

/// Names in bytewise order and, by their number before, the place of each.
std::pair<std::vector<std::string>, std::vector<std::uint32_t>> sorted(
    const std::vector<std::string>& names) {
    std::vector<std::uint32_t> order(names.size());
    std::iota(order.begin(), order.end(), 0U);
    std::ranges::sort(
        order, {}, [&](std::uint32_t n) -> auto& { return names[n]; });
    std::vector<std::string> ordered;
    std::vector<std::uint32_t> places(order.size());
    for (const auto n : order) {
        places[n] = static_cast<std::uint32_t>(ordered.size());
        ordered.push_back(names[n]);
    }
    return {std::move(ordered), std::move(places)};
}

/// The name of the column that this one says something about: "rmse" of "rmse_bound".
std::string_view described_column(std::string_view column) {
    for (const std::string_view suffix : {"_bound", "_precision"}) {
        if (column.ends_with(suffix)) {
            return column.substr(0, column.size() - suffix.size());
        }
    }
    return {};
}

std::string joined(std::span<const std::string> texts) {
    return fmt::format("{}", fmt::join(texts, ", "));
}

/// The names in the header that are metrics.
std::vector<std::string> metrics_of(const std::vector<std::string>& header,
                                    const CsvReader& reader) {
    const bool known =
        header.size() >= 2 && ((header[0] == "material_a" && header[1] == "material_b") ||
                               (header[0] == "material_1" && header[1] == "material_2"));
    if (!known) {
        reader.fail(
            fmt::format("found {}; expected material_a, material_b, and one for each metric",
                        columns_text(header)));
    }
    auto sorted = header;
    std::ranges::sort(sorted);
    if (const auto twice = std::ranges::adjacent_find(sorted); twice != sorted.end()) {
        reader.fail(fmt::format("found the column \"{}\" twice", *twice));
    }
    std::vector<std::string> metrics;
    for (const auto& column : std::span(header).subspan(2)) {
        if (column.empty()) {
            reader.fail(fmt::format("found {}; expected a name for each", columns_text(header)));
        }
        if (!std::ranges::binary_search(sorted, described_column(column))) {
            metrics.push_back(column);
        }
    }
    if (metrics.empty()) {
        reader.fail("found no metric; expected a column for each after the two materials");
    }
    return metrics;
}

/// Where in a row the wanted metrics are.
std::vector<std::size_t> places_of(std::span<const std::string> wanted,
                                   const std::vector<std::string>& header,
                                   std::span<const std::string> metrics, const CsvReader& reader) {
    std::vector<std::size_t> places;
    for (const auto& metric : wanted) {
        if (std::ranges::find(metrics, metric) == metrics.end()) {
            reader.fail(fmt::format("there is no metric \"{}\"; the columns are: {}", metric,
                                    joined(metrics)));
        }
        places.push_back(
            static_cast<std::size_t>(std::ranges::find(header, metric) - header.begin()));
    }
    return places;
}

double parse_distance(const std::string& text, const std::string& metric, const CsvReader& reader) {
    const auto value = parse_magnitude(text);
    if (!value) {
        reader.fail(
            fmt::format("{}: found \"{}\"; expected a finite number, zero or more", metric, text));
    }
    return *value + 0.0;  // -0 becomes 0
}

/// For every pair in pair order the row that has it. Each must be there exactly once.
std::vector<std::uint32_t> rows_by_pair(const std::vector<Row>& rows,
                                        const std::vector<std::string>& names,
                                        const std::vector<std::uint32_t>& places,
                                        const std::string& file) {
    const auto materials = static_cast<std::uint32_t>(names.size());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;  // pair, row
    found.reserve(rows.size());
    for (std::uint32_t row = 0; row < rows.size(); ++row) {
        const auto [first, second] = std::minmax(places[rows[row].a], places[rows[row].b]);
        found.emplace_back(pair_index({first, second}, materials), row);
    }
    std::ranges::sort(found);
    const auto text_of = [&](std::uint32_t index) {
        const Pair pair = pair_at(index, materials);
        return fmt::format(R"("{}" and "{}")", names[pair.first], names[pair.second]);
    };
    const auto same_pair = [](const auto& x, const auto& y) { return x.first == y.first; };
    if (const auto twice = std::ranges::adjacent_find(found, same_pair); twice != found.end()) {
        throw InputError(fmt::format(
            "{}, line {}: found {} again, which line {} has; expected "
            "every pair once",
            file, rows[(twice + 1)->second].line, text_of(twice->first), rows[twice->second].line));
    }
    // Before anything as large as the pairs is made: few rows can name many materials.
    const std::uint64_t pairs = pair_count(materials);
    if (found.size() < pairs) {
        std::uint32_t missing = 0;
        while (missing < found.size() && found[missing].first == missing) {
            ++missing;
        }
        throw InputError(
            fmt::format("{}: found {} pairs of {} materials; expected all {}: {} are "
                        "missing",
                        file, found.size(), materials, pairs, text_of(missing)));
    }
    std::vector<std::uint32_t> result;
    result.reserve(found.size());
    std::ranges::transform(found, std::back_inserter(result),
                           [](const auto& f) { return f.second; });
    return result;
}

}  // namespace

Distances DistanceTable::distances(std::size_t first, std::size_t second) const {
    const MetricColumn& a = metrics.at(first);
    const MetricColumn& b = metrics.at(second);
    return {.names = names,
            .first_metric = a.metric,
            .second_metric = b.metric,
            .first = a.values,
            .second = b.values,
            .first_bounds = a.bounds,
            .second_bounds = b.bounds,
            .first_is_final = a.is_final,
            .second_is_final = b.is_final};
}

DistanceTable parse_distance_table(std::string_view text, const std::string& file,
                                   std::span<const std::string> columns,
                                   const std::function<void(double share)>& progress) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    const auto metrics = metrics_of(header, reader);
    const std::vector<std::string> wanted =
        columns.empty() ? metrics : std::vector(columns.begin(), columns.end());
    const auto places = places_of(wanted, header, metrics, reader);

    MaterialNumbers materials;
    std::vector<Row> rows;
    std::vector<std::vector<double>> values(wanted.size());  // by row
    // Growing would take three times as much.
    const std::size_t most = reader.most_rows();
    rows.reserve(most);
    for (auto& column : values) {
        column.reserve(most);
    }
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (fields[0].empty() || fields[1].empty()) {
            reader.fail("found a material without a name");
        }
        if (fields[0] == fields[1]) {
            reader.fail(fmt::format("found \"{}\" with itself; expected two materials", fields[0]));
        }
        const std::uint32_t a = materials.number(fields[0], reader);
        const std::uint32_t b = materials.number(fields[1], reader);
        rows.push_back({a, b, reader.line()});
        for (std::size_t m = 0; m < wanted.size(); ++m) {
            values[m].push_back(parse_distance(fields[places[m]], wanted[m], reader));
        }
        if (progress && rows.size() % kRowsPerUpdate == 0) {
            progress(reader.share());
        }
    }
    if (rows.empty()) {
        reader.fail("found no pair after the header; expected every pair of the materials");
    }

    const auto [names, order] = sorted(materials.names());
    const auto by_pair = rows_by_pair(rows, names, order, file);
    DistanceTable table = {names, {}};
    for (std::size_t m = 0; m < wanted.size(); ++m) {
        MetricColumn column = {wanted[m], {}, {}};
        column.values.reserve(by_pair.size());
        std::ranges::transform(by_pair, std::back_inserter(column.values),
                               [&](std::uint32_t row) { return values[m][row]; });
        std::vector<double>().swap(values[m]);
        table.metrics.push_back(std::move(column));
    }
    return table;
}

void write_distance_table(int file, const DistanceTable& table,
                          const std::function<void(double share)>& progress) {
    std::string text = "material_a,material_b";
    for (const auto& column : table.metrics) {
        text += ',' + csv_field(column.metric);
    }
    text += '\n';
    std::vector<std::string> names;
    std::ranges::transform(table.names, std::back_inserter(names),
                           [](const std::string& name) { return csv_field(name); });
    for (std::uint32_t index = 0; index < table.pairs(); ++index) {
        const Pair pair = pair_at(index, table.materials());
        text += names[pair.first] + ',' + names[pair.second];
        for (const auto& column : table.metrics) {
            text += ',';
            append_number(text, column.values.at(index));
        }
        text += '\n';
        if (index % kRowsPerUpdate == kRowsPerUpdate - 1) {
            write_all(file, text);
            text.clear();
            if (progress) {
                progress(static_cast<double>(index + 1) / static_cast<double>(table.pairs()));
            }
        }
    }
    write_all(file, text);
}

}  // namespace merl::scan
