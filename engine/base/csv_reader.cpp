#include "engine/base/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/number.h"
#include "engine/base/text.h"

namespace merl {
namespace {

/// What separates the columns of a text, by its first line.
char separator_of(std::string_view text) {
    bool quoted = false;
    bool semicolon = false;
    bool tab = false;
    for (const char c : text.substr(std::min(text.find_first_not_of("\r\n"), text.size()))) {
        quoted ^= c == '"';
        if (!quoted && (c == ',' || c == '\n')) {
            return c == ',' ? ',' : semicolon ? ';' : tab ? '\t' : ',';
        }
        semicolon |= !quoted && c == ';';
        tab |= !quoted && c == '\t';
    }
    return semicolon ? ';' : tab ? '\t' : ',';
}

std::string_view name_of(char separator) {
    return separator == ',' ? "comma" : separator == ';' ? "semicolon" : "tab";
}

bool is_blank(std::string_view text) {
    return text.find_first_not_of(" \t") == std::string_view::npos;
}

bool is_blank(const std::vector<std::string>& fields) {
    return std::ranges::all_of(fields, [](const auto& field) { return is_blank(field); });
}

/// Whether a column of this name has the numbers of the rows: R and pandas write none, and pandas
/// calls such a column so when it has read it.
bool numbers_rows(const std::string& column) {
    return column.empty() || column == "Unnamed: 0";
}

}  // namespace

std::string columns_text(const std::vector<std::string>& header) {
    constexpr std::size_t kMost = 16;
    const auto shown = std::min(header.size(), kMost);
    const auto any = [&](const auto& has) { return std::ranges::any_of(header, has); };
    const bool has_semicolons =
        any([](const auto& column) { return column.find(';') != std::string::npos; });
    const bool has_blanks = any([](const auto& column) { return trimmed(column) != column; });
    return fmt::format(
        "{} column{}, \"{}{}\"{}", header.size(), header.size() == 1 ? "" : "s",
        fmt::join(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(shown), ","),
        shown < header.size() ? ",..." : "",
        has_semicolons ? " (semicolons separate columns where no comma is in the header, unless "
                         "in quotes)"
        : has_blanks   ? " (blanks around a name are part of it)"
                       : "");
}

CsvReader::CsvReader(std::string_view text, std::string file)
    : text_(text), file_(std::move(file)) {
    if (const auto zero = text_.find('\0'); zero != std::string_view::npos) {
        row_line_ += static_cast<std::uint64_t>(
            std::count(text_.begin(), text_.begin() + static_cast<std::ptrdiff_t>(zero), '\n'));
        fail("found a byte 0; expected text in UTF-8 (UTF-16 has to be converted)");
    }
    position_ = text_.size() - without_byte_order_mark(text_).size();
    skip_lines_without_content();
    separator_ = separator_of(text_.substr(position_));
}

std::vector<std::string> CsvReader::header() {
    auto fields = header_of_matrix();
    if (numbers_rows(fields.front()) && fields.size() > 1) {
        fields.erase(fields.begin());
        numbers_rows_ = true;
        --width_;
    }
    return fields;
}

std::vector<std::string> CsvReader::header_of_matrix() {
    std::vector<std::string> fields;
    do {
        if (!read_row(fields)) {
            fail("found no row; expected a header");
        }
    } while (is_blank(fields));
    full_width_ = fields.size();
    while (is_blank(fields.back())) {
        fields.pop_back();
    }
    width_ = fields.size();
    return fields;
}

bool CsvReader::next(std::vector<std::string>& fields) {
    do {
        if (!read_row(fields)) {
            return false;
        }
    } while (width_ != 0 && is_blank(fields.front()) && is_blank(fields));
    if (width_ != 0) {
        fit_to_header(fields);
    }
    return true;
}

std::optional<double> CsvReader::number(std::string_view field) {
    const auto mark = field.find_first_of(".,");
    if (mark == std::string_view::npos) {
        return parse_finite(field);
    }
    std::optional<double> value;
    if (field[mark] == '.') {
        value = parse_finite(field);
    } else if (separator_ != ',' && field.find('.') == std::string_view::npos) {
        std::string text(field);
        text[mark] = '.';
        value = parse_finite(text);
    }
    if (value) {
        note_decimal_mark(field, field[mark]);
    }
    return value;
}

std::optional<double> CsvReader::magnitude(std::string_view field) {
    const auto value = number(field);
    return value && *value >= 0 ? value : std::nullopt;
}

std::optional<std::uint64_t> CsvReader::whole_number(std::string_view field) {
    const auto mark = field.size() < 2 ? '\0' : field[field.size() - 2];
    if (field.ends_with('0') && (mark == '.' || (mark == ',' && separator_ != ','))) {
        const auto value = parse_number<std::uint64_t>(field.substr(0, field.size() - 2));
        if (value) {
            note_decimal_mark(field, mark);
        }
        return value;
    }
    return parse_number<std::uint64_t>(field);
}

std::string CsvReader::decimal_comma_hint(std::string_view field) const {
    const bool could_be = separator_ == ',' && std::ranges::count(field, ',') == 1 &&
                          field.find_first_not_of("+-0123456789,eE") == std::string_view::npos;
    return could_be ? " (a comma is a decimal mark only where semicolons or tabs separate columns)"
                    : "";
}

std::size_t CsvReader::most_rows() const {
    return static_cast<std::size_t>(std::ranges::count(text_.substr(position_), '\n')) + 1;
}

double CsvReader::share() const {
    return text_.empty() ? 1 : static_cast<double>(position_) / static_cast<double>(text_.size());
}

void CsvReader::fail(const std::string& what) const {
    throw InputError(fmt::format("{}, line {}: {}", file_, row_line_, what));
}

/// Those before the header, whatever separates their columns.
void CsvReader::skip_lines_without_content() {
    const auto content = text_.find_first_not_of("\r\n \t,;", position_);
    const auto end = content == std::string_view::npos ? content : text_.rfind('\n', content);
    if (end != std::string_view::npos && end >= position_) {
        const auto lines = text_.substr(position_, end + 1 - position_);
        line_ += static_cast<std::uint64_t>(std::ranges::count(lines, '\n'));
        position_ = end + 1;
    }
}

bool CsvReader::read_row(std::vector<std::string>& fields) {
    while (take_line_end()) {
    }
    if (position_ == text_.size()) {
        return false;
    }
    row_line_ = line_;
    fields.clear();
    for (;;) {
        if (fields.size() == max_csv_fields) {
            fail(fmt::format("found more than {} fields", max_csv_fields));
        }
        std::string& field = fields.emplace_back();
        if (position_ < text_.size() && text_[position_] == '"') {
            read_quoted(field);
        } else {
            read_plain(field);
        }
        if (position_ == text_.size() || take_line_end()) {
            return true;
        }
        if (text_[position_] != separator_) {
            fail(
                fmt::format("field {}: found \"{}\" after its closing quote; expected a {} or "
                            "the end of the line (a quote inside a quoted field is doubled)",
                            fields.size(), text_[position_], name_of(separator_)));
        }
        ++position_;
    }
}

/// Takes off what is not below a name.
void CsvReader::fit_to_header(std::vector<std::string>& fields) const {
    const std::size_t width = width_ + (numbers_rows_ ? 1 : 0);
    const auto found = fields.size();
    // Where commas separate, a row that is wider than the header may have a decimal comma.
    const bool may_be_cut = separator_ != ',' || found <= full_width_;
    while (may_be_cut && fields.size() > width && is_blank(fields.back())) {
        fields.pop_back();
    }
    if (fields.size() != width) {
        const auto* const hint =
            found > width && separator_ == ','
                ? " (a decimal comma makes two fields of a number: with semicolons between columns "
                  "it does not)"
                : "";
        if (may_be_cut && fields.size() > width && fields.size() <= full_width_) {
            fail(
                fmt::format("found \"{}\" in column {}, which is without a name; expected a name "
                            "for it, or nothing below{}",
                            fields.back(), fields.size(), hint));
        }
        fail(fmt::format("found {} fields; expected {}, as in the header{}", found, width, hint));
    }
    if (!numbers_rows_) {
        return;
    }
    if (fields.front().find_first_not_of("0123456789") != std::string::npos) {
        fail(
            fmt::format("found \"{}\" in the first column, which has no name; expected a name for "
                        "it, or nothing but row numbers below",
                        fields.front()));
    }
    fields.erase(fields.begin());
}

void CsvReader::note_decimal_mark(std::string_view field, char mark) {
    if (separator_ == ',') {
        return;  // a comma cannot be one
    }
    if (decimal_mark_ != 0 && decimal_mark_ != mark) {
        fail(
            fmt::format("found \"{}\", and in line {} a number with a decimal {}; expected one "
                        "decimal mark, and nothing between thousands",
                        field, decimal_line_, decimal_mark_ == ',' ? "comma" : "point"));
    }
    if (decimal_mark_ == 0) {
        decimal_mark_ = mark;
        decimal_line_ = row_line_;
    }
}

void CsvReader::read_quoted(std::string& field) {
    for (;;) {
        const auto begin = position_ + 1;
        const auto quote = text_.find('"', begin);
        if (quote == std::string_view::npos) {
            fail("found a quote that is never closed");
        }
        const auto part = text_.substr(begin, quote - begin);
        line_ += static_cast<std::uint64_t>(std::ranges::count(part, '\n'));
        field += part;
        position_ = quote + 1;
        if (position_ == text_.size() || text_[position_] != '"') {
            return;
        }
        field += '"';
    }
}

void CsvReader::read_plain(std::string& field) {
    const std::array<char, 4> ends = {separator_, '"', '\r', '\n'};
    const auto end = std::min(
        text_.find_first_of(std::string_view(ends.data(), ends.size()), position_), text_.size());
    field = text_.substr(position_, end - position_);
    position_ = end;
    if (end == text_.size() || text_[end] == separator_ || text_[end] == '\n' ||
        text_.substr(end).starts_with("\r\n")) {
        return;
    }
    fail(text_[end] == '"' ? "found a quote inside a field that has none around it"
                           : "found a carriage return without a line feed");
}

bool CsvReader::take_line_end() {
    const auto rest = text_.substr(position_);
    if (!rest.starts_with('\n') && !rest.starts_with("\r\n")) {
        return false;
    }
    position_ += rest[0] == '\n' ? 1 : 2;
    ++line_;
    return true;
}

}  // namespace merl
