#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/error.h"

namespace merl {

/// The most fields of a row.
inline constexpr std::size_t max_csv_fields = 4096;

/// A header as errors say what they found: how many columns, and what they are called, of many only
/// the first.
std::string columns_text(const std::vector<std::string>& header);

/// Reads the rows of a CSV text as RFC 4180 has them: quoted fields with doubled quotes, commas and
/// line breaks inside; lines end in LF or CR LF. A byte order mark before the text and empty lines
/// are skipped. Whatever else is not RFC 4180 is an InputError that names the line.
class CsvReader {
  public:
    /// `file` is what errors call the text, which must outlive the reader.
    CsvReader(std::string_view text, std::string file);

    /// The first row, or an InputError where there is none. From then on a row with another number
    /// of fields is an InputError.
    std::vector<std::string> header();

    /// Puts the next row into `fields` and returns true, or returns false after the last one.
    bool next(std::vector<std::string>& fields);

    /// Where the last row begins, counted from 1.
    std::uint64_t line() const { return row_line_; }

    /// So many rows or fewer follow.
    std::size_t most_rows() const;

    /// The share of the text that is read, from 0 to 1.
    double share() const;

    /// Throws InputError: the file, the line of the last row, and `what`.
    [[noreturn]] void fail(const std::string& what) const;

  private:
    void read_quoted(std::string& field);
    void read_plain(std::string& field);
    bool take_line_end();

    std::string_view text_;
    std::string file_;
    std::size_t position_ = 0;
    std::uint64_t line_ = 1;  // of position_
    std::uint64_t row_line_ = 1;
    std::size_t width_ = 0;  // fields of the header; 0 without one
};

}  // namespace merl
