#include "engine/base/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "engine/base/text.h"

namespace merl {

std::string columns_text(const std::vector<std::string>& header) {
    constexpr std::size_t kMost = 16;
    const auto shown = std::min(header.size(), kMost);
    return fmt::format(
        "{} column{}, \"{}{}\"{}", header.size(), header.size() == 1 ? "" : "s",
        fmt::join(header.begin(), header.begin() + static_cast<std::ptrdiff_t>(shown), ","),
        shown < header.size() ? ",..." : "",
        header.size() > 1 && header.back().empty()
            ? ", the last without a name (a comma at the end of the line begins one more)"
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
}

std::vector<std::string> CsvReader::header() {
    std::vector<std::string> fields;
    if (!next(fields)) {
        fail("found no row; expected a header");
    }
    width_ = fields.size();
    return fields;
}

bool CsvReader::next(std::vector<std::string>& fields) {
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
            break;
        }
        if (text_[position_] != ',') {
            fail(
                fmt::format("field {}: found \"{}\" after its closing quote; expected a comma or "
                            "the end of the line (a quote inside a quoted field is doubled)",
                            fields.size(), text_[position_]));
        }
        ++position_;
    }
    if (width_ != 0 && fields.size() != width_) {
        fail(fmt::format("found {} fields; expected {}, as in the header", fields.size(), width_));
    }
    return true;
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
    const auto end = std::min(text_.find_first_of(",\"\r\n", position_), text_.size());
    field = text_.substr(position_, end - position_);
    position_ = end;
    if (end == text_.size() || text_[end] == ',' || text_[end] == '\n' ||
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
