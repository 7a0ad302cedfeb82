#include "scan/score/rating_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "engine/base/csv_reader.h"
#include "scan/pairs/material_numbers.h"
#include "scan/score/judgements.h"

namespace merl::scan {
namespace {

/// Rows between two calls of progress.
constexpr std::uint64_t rows_per_update = 4096;

struct Format {
    const char* name;
    std::array<const char*, 3> columns;  // original, approximation, rating
    bool higher_is_better;
    std::optional<RatingScale> scale;
};

const std::array<Format, 3> formats = {
    {{"ratings CSV", {"original", "approximation", "rating"}, true, std::nullopt},
     {"differences CSV", {"original", "approximation", "difference"}, false, std::nullopt},
     {"Lavoué 2021", {"BRDF", "METHOD", "DISTANCE"}, false, RatingScale{0, 1}}}};

bool has(const std::vector<std::string>& header, const char* column) {
    return std::ranges::find(header, column) != header.end();
}

/// The format whose columns are there.
const Format& format_of(const std::vector<std::string>& header, const CsvReader& reader) {
    const Format* found = nullptr;
    for (const auto& format : formats) {
        if (!std::ranges::all_of(format.columns, [&](auto c) { return has(header, c); })) {
            continue;
        }
        if (found != nullptr) {
            reader.fail(fmt::format(R"(found the columns "{}" and "{}"; expected one of them)",
                                    found->columns[2], format.columns[2]));
        }
        found = &format;
    }
    if (found == nullptr) {
        reader.fail(fmt::format(
            "found {}; expected original, approximation, and rating (the higher, the more alike) "
            "or difference (the higher, the less alike); or BRDF, METHOD and DISTANCE",
            columns_text(header)));
    }
    for (const auto* column : found->columns) {
        if (std::ranges::count(header, column) > 1) {
            reader.fail(fmt::format("found the column \"{}\" twice", column));
        }
    }
    return *found;
}

std::size_t place_of(const std::vector<std::string>& header, const char* column) {
    return static_cast<std::size_t>(std::ranges::find(header, column) - header.begin());
}

}  // namespace

RatingFile parse_ratings(std::string_view text, const std::string& file,
                         std::optional<RatingScale> scale,
                         const std::function<void(double share)>& progress) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    const auto& format = format_of(header, reader);
    const std::array<std::size_t, 3> places = {place_of(header, format.columns[0]),
                                               place_of(header, format.columns[1]),
                                               place_of(header, format.columns[2])};
    RatingFile result = {.file = file,
                         .format = format.name,
                         .higher_is_better = format.higher_is_better,
                         .scale = scale ? scale : format.scale,
                         .names = {},
                         .rows = {}};
    MaterialNumbers names;
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (result.rows.size() == max_judgement_rows) {
            reader.fail(fmt::format("found more than {} rows", max_judgement_rows));
        }
        for (const std::size_t c : {0U, 1U}) {
            if (fields[places[c]].empty()) {
                reader.fail(fmt::format("{}: found no name; expected one", format.columns[c]));
            }
        }
        const auto& field = fields[places[2]];
        const auto rating = reader.number(field);
        if (field.empty()) {
            reader.fail(fmt::format("{}: found nothing; expected a finite number, or no such row",
                                    format.columns[2]));
        }
        if (!rating) {
            reader.fail(fmt::format("{}: found \"{}\"; expected a finite number{}",
                                    format.columns[2], field, reader.decimal_comma_hint(field)));
        }
        if (std::abs(*rating) > max_rating) {
            reader.fail(fmt::format("{}: found {}; expected a number of at most {:g} in size",
                                    format.columns[2], *rating, max_rating));
        }
        if (result.scale && (*rating < result.scale->low || *rating > result.scale->high)) {
            reader.fail(fmt::format("{}: found {}; expected a number from {} to {}, the scale{}",
                                    format.columns[2], *rating, result.scale->low,
                                    result.scale->high,
                                    scale ? " of --scale" : " of these ratings"));
        }
        result.rows.push_back({names.number(fields[places[0]], reader),
                               names.number(fields[places[1]], reader),
                               *rating + 0.0});  // -0 becomes 0
        if (progress && result.rows.size() % rows_per_update == 0) {
            progress(reader.share());
        }
    }
    if (result.rows.empty()) {
        reader.fail("found no row after the header; expected a rating");
    }
    result.names = names.names();
    return result;
}

RatingNames parse_rating_names(std::string_view text, const std::string& file) {
    CsvReader reader(text, file);
    const auto header = reader.header();
    if (header != std::vector<std::string>{"name_in_ratings", "name"}) {
        reader.fail(
            fmt::format("found {}; expected \"name_in_ratings,name\"", columns_text(header)));
    }
    RatingNames names;
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        if (fields[0].empty() || fields[1].empty()) {
            reader.fail("found no name; expected one in each column");
        }
        const auto [place, added] = names.try_emplace(fields[0], fields[1]);
        if (!added && place->second != fields[1]) {
            reader.fail(
                fmt::format("found \"{}\" for \"{}\", which is \"{}\" in a row before; "
                            "expected one name for it",
                            fields[1], fields[0], place->second));
        }
    }
    if (names.empty()) {
        reader.fail("found no row after the header; expected a name");
    }
    return names;
}

}  // namespace merl::scan
