#include "scan/pairs/listed_distances.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "engine/base/csv_reader.h"
#include "engine/base/error.h"
#include "scan/pairs/material_numbers.h"

namespace merl::scan {
namespace {

/// Rows between two calls of progress.
constexpr std::uint64_t kRowsPerUpdate = 4096;

/// A pair of materials that are numbered as they first occurred.
struct Row {
    std::uint32_t a;
    std::uint32_t b;
    std::uint64_t line;
};

/// What a file says: rows, and the distances of each.
struct Rows {
    std::vector<std::string> names;  // by number
    std::vector<std::string> metrics;
    std::vector<Row> list;
    std::vector<std::vector<double>> values;  // of each metric, by row
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

/// Whether the columns begin with the two materials of a pair.
bool begin_with_pair(std::span<const std::string> columns) {
    return columns.size() >= 2 && ((columns[0] == "material_1" && columns[1] == "material_2") ||
                                   (columns[0] == "material_a" && columns[1] == "material_b"));
}

/// The names in the header that are metrics.
std::vector<std::string> metrics_of(const std::vector<std::string>& header,
                                    const CsvReader& reader) {
    if (!begin_with_pair(header)) {
        reader.fail(
            fmt::format("found {}; expected material_1, material_2, and one for each metric, or a "
                        "square matrix with the names of the materials in the first row and, the "
                        "same, in the first column",
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
            reader.fail(fmt::format("found a column without a name in {}; expected a name for each",
                                    columns_text(header)));
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

double parse_distance(const std::string& text, const std::string& metric, CsvReader& reader) {
    const auto value = reader.magnitude(text);
    if (!value) {
        reader.fail(fmt::format("{}: found \"{}\"; expected a finite number, zero or more{}",
                                metric, text, reader.decimal_comma_hint(text)));
    }
    return *value + 0.0;  // -0 becomes 0
}

/// A material with itself: at distance 0 it says nothing.
void expect_zero(const std::string& material, double distance, const std::string& metric,
                 const CsvReader& reader) {
    if (distance != 0) {
        reader.fail(
            fmt::format("{}: found \"{}\" with itself at the distance {}; expected 0, or no "
                        "such row",
                        metric, material, distance));
    }
}

/// A table of one row a pair.
Rows read_rows(std::string_view text, const std::string& file, std::span<const std::string> columns,
               const std::function<void(double share)>& progress) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    const auto metrics = metrics_of(header, reader);
    Rows rows;
    rows.metrics = columns.empty() ? metrics : std::vector(columns.begin(), columns.end());
    const auto places = places_of(rows.metrics, header, metrics, reader);
    MaterialNumbers materials;
    rows.values.resize(rows.metrics.size());
    // Growing would take three times as much.
    const std::size_t most = reader.most_rows();
    rows.list.reserve(most);
    for (auto& column : rows.values) {
        column.reserve(most);
    }
    std::vector<std::string> fields;
    for (std::uint64_t read = 1; reader.next(fields); ++read) {
        if (fields[0].empty() || fields[1].empty()) {
            reader.fail("found a material without a name");
        }
        const std::uint32_t a = materials.number(fields[0], reader);
        const std::uint32_t b = materials.number(fields[1], reader);
        for (std::size_t m = 0; m < rows.metrics.size(); ++m) {
            const double distance = parse_distance(fields[places[m]], rows.metrics[m], reader);
            if (a == b) {
                expect_zero(fields[0], distance, rows.metrics[m], reader);
            } else {
                rows.values[m].push_back(distance);
            }
        }
        if (a != b) {
            rows.list.push_back({a, b, reader.line()});
        }
        if (progress && read % kRowsPerUpdate == 0) {
            progress(reader.share());
        }
    }
    if (rows.list.empty()) {
        reader.fail("found no pair after the header; expected pairs of materials");
    }
    rows.names = materials.names();
    return rows;
}

/// The name that a file gives to the metric whose matrix it is.
std::string stem_of(const std::string& file) {
    return std::filesystem::path(file).stem();
}

/// Whether a text is a square matrix: its second row is of one of the materials over its columns.
bool is_matrix(std::string_view text, const std::string& file) {
    if (begin_with_pair(CsvReader(text, file).header())) {
        return false;
    }
    CsvReader reader(text, file);
    const auto names = reader.header_of_matrix();
    std::vector<std::string> row;
    return names.size() > 2 && reader.next(row) &&
           std::find(names.begin() + 1, names.end(), row[0]) != names.end();
}

/// The names over the columns of a matrix, and which column each is.
std::unordered_map<std::string, std::uint32_t> columns_of(std::span<const std::string> names,
                                                          const CsvReader& reader) {
    std::unordered_map<std::string, std::uint32_t> columns;
    for (const auto& name : names) {
        if (name.empty()) {
            reader.fail("found a material without a name in the header of a square matrix");
        }
        if (!columns.emplace(name, static_cast<std::uint32_t>(columns.size())).second) {
            reader.fail(
                fmt::format("found the material \"{}\" twice in the header of a square "
                            "matrix; expected different names",
                            name));
        }
    }
    return columns;
}

/// A square matrix of one metric.
Rows read_matrix(std::string_view text, const std::string& file,
                 std::span<const std::string> columns,
                 const std::function<void(double share)>& progress) {
    CsvReader reader(text, file);
    auto header = reader.header_of_matrix();
    Rows rows;
    rows.metrics = {stem_of(file)};
    if (!columns.empty() && !std::ranges::equal(columns, rows.metrics)) {
        reader.fail(
            fmt::format("there is no metric \"{}\"; a square matrix has one, which is "
                        "called what the file is: {}",
                        joined(columns), rows.metrics[0]));
    }
    rows.names.assign(header.begin() + 1, header.end());
    const auto places = columns_of(rows.names, reader);
    std::vector<std::uint64_t> lines(rows.names.size());  // 0: not yet
    rows.values.resize(1);
    std::vector<std::string> fields;
    for (std::uint64_t read = 0; reader.next(fields);) {
        const auto found = places.find(fields[0]);
        if (found == places.end()) {
            reader.fail(
                fmt::format("found \"{}\" before a row of a square matrix; expected one of "
                            "the names in its header",
                            fields[0]));
        }
        const auto row = found->second;
        if (lines[row] != 0) {
            reader.fail(
                fmt::format("found \"{}\" again, which line {} has; expected a row for each",
                            fields[0], lines[row]));
        }
        lines[row] = reader.line();
        for (std::uint32_t column = 0; column < rows.names.size(); ++column) {
            const auto& field = fields[column + 1];
            if (field.empty()) {
                continue;  // the other triangle may have it
            }
            const double distance = parse_distance(field, rows.names[column], reader);
            if (row == column) {
                expect_zero(fields[0], distance, rows.metrics[0], reader);
                continue;
            }
            rows.list.push_back({row, column, reader.line()});
            rows.values[0].push_back(distance);
            if (progress && ++read % kRowsPerUpdate == 0) {
                progress(reader.share());
            }
        }
    }
    const auto missing = std::ranges::find(lines, 0U);
    if (missing != lines.end()) {
        throw InputError(fmt::format(
            "{}: found no row for \"{}\"; a square matrix has one for each name in its header",
            file, rows.names[static_cast<std::size_t>(missing - lines.begin())]));
    }
    if (rows.list.empty()) {
        reader.fail("found no distance in a square matrix; expected one for each pair");
    }
    return rows;
}

/// Throws unless two rows of a pair say the same.
void expect_same(const Rows& rows, std::uint32_t before, std::uint32_t again,
                 const std::string& file) {
    for (std::size_t m = 0; m < rows.metrics.size(); ++m) {
        const double first = rows.values[m][before];
        const double second = rows.values[m][again];
        if (first != second) {
            const auto& row = rows.list[again];
            throw InputError(fmt::format(
                "{}, line {}: {}: found {} for \"{}\" and \"{}\", and {} in line {}; expected one "
                "distance for a pair, in whichever direction",
                file, row.line, rows.metrics[m], second, rows.names[std::min(row.a, row.b)],
                rows.names[std::max(row.a, row.b)], first, rows.list[before].line));
        }
    }
}

/// The rows by pair, each pair once.
ListedDistances listed(Rows rows, const std::string& file) {
    ListedDistances result;
    auto [names, places] = sorted(rows.names);
    const auto materials = static_cast<std::uint32_t>(names.size());
    std::vector<std::pair<std::uint32_t, std::uint32_t>> found;  // pair, row
    found.reserve(rows.list.size());
    for (std::uint32_t row = 0; row < rows.list.size(); ++row) {
        const auto [first, second] =
            std::minmax(places[rows.list[row].a], places[rows.list[row].b]);
        found.emplace_back(pair_index({first, second}, materials), row);
    }
    std::ranges::sort(found);
    std::vector<std::uint32_t> kept;  // rows
    kept.reserve(found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (i > 0 && found[i - 1].first == found[i].first) {
            expect_same(rows, kept.back(), found[i].second, file);
            continue;
        }
        kept.push_back(found[i].second);
        result.pairs.push_back(pair_at(found[i].first, materials));
    }
    for (std::size_t m = 0; m < rows.metrics.size(); ++m) {
        MetricColumn column = {rows.metrics[m], {}, {}};
        column.values.reserve(kept.size());
        std::ranges::transform(kept, std::back_inserter(column.values),
                               [&](std::uint32_t row) { return rows.values[m][row]; });
        std::vector<double>().swap(rows.values[m]);
        result.metrics.push_back(std::move(column));
    }
    result.names = std::move(names);
    return result;
}

}  // namespace

std::optional<std::size_t> ListedDistances::place_of(Pair pair) const {
    const auto order = [](const Pair& one) { return std::pair(one.first, one.second); };
    const auto found = std::ranges::lower_bound(pairs, order(pair), {}, order);
    return found == pairs.end() || *found != pair
               ? std::nullopt
               : std::optional(static_cast<std::size_t>(found - pairs.begin()));
}

ListedDistances parse_listed_distances(std::string_view text, const std::string& file,
                                       std::span<const std::string> columns,
                                       const std::function<void(double share)>& progress) {
    return listed(is_matrix(text, file) ? read_matrix(text, file, columns, progress)
                                        : read_rows(text, file, columns, progress),
                  file);
}

}  // namespace merl::scan
