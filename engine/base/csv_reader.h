#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
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

/// Reads the rows of a CSV text as RFC 4180 has them: quoted fields with doubled quotes, separators
/// and line breaks inside; lines end in LF or CR LF. A byte order mark before the text and empty
/// lines are skipped. Columns are separated by commas; by semicolons, or else tabs, where the first
/// line has them and no comma outside quotes. Whatever else is not RFC 4180 is an InputError that
/// names the line.
///
/// Below a header it takes what spreadsheets and data frames add: columns at the end without a name
/// and without content (where commas separate, only those that the header has too: a decimal comma
/// makes a row wider), rows without content, and a first column without a name that has nothing
/// but row numbers. Nothing of that is left in the fields.
class CsvReader {
  public:
    /// `file` is what errors call the text, which must outlive the reader.
    CsvReader(std::string_view text, std::string file);

    /// The first row with content, or an InputError where there is none. From then on a row with
    /// another number of fields is an InputError.
    std::vector<std::string> header();

    /// The same of a matrix, whose first column has the names of the rows, whatever it is called.
    std::vector<std::string> header_of_matrix();

    /// Puts the next row into `fields` and returns true, or returns false after the last one.
    bool next(std::vector<std::string>& fields);

    /// A field as a finite decimal number (std::from_chars); none for any other text. Where the
    /// separator is no comma, the decimal mark may be one. Throws InputError where a number before
    /// has the other mark: one of the two may separate thousands.
    std::optional<double> number(std::string_view field);

    /// The same, zero or more.
    std::optional<double> magnitude(std::string_view field);

    /// A field as a whole number, zero or more, which may be written as 3.0, as data frames do. Not
    /// as 3.000, which may mean three thousand.
    std::optional<std::uint64_t> whole_number(std::string_view field);

    /// What to say after what was expected in the place of a field that is no number: of a decimal
    /// comma where the separator is a comma too, otherwise nothing.
    std::string decimal_comma_hint(std::string_view field) const;

    /// Where the last row begins, counted from 1.
    std::uint64_t line() const { return row_line_; }

    /// So many rows or fewer follow.
    std::size_t most_rows() const;

    /// The share of the text that is read, from 0 to 1.
    double share() const;

    /// Throws InputError: the file, the line of the last row, and `what`.
    [[noreturn]] void fail(const std::string& what) const;

  private:
    void skip_lines_without_content();
    bool read_row(std::vector<std::string>& fields);
    void fit_to_header(std::vector<std::string>& fields) const;
    void read_quoted(std::string& field);
    void read_plain(std::string& field);
    bool take_line_end();
    void note_decimal_mark(std::string_view field, char mark);

    std::string_view text_;
    std::string file_;
    char separator_ = ',';
    std::size_t position_ = 0;
    std::uint64_t line_ = 1;  // of position_
    std::uint64_t row_line_ = 1;
    std::size_t full_width_ = 0;  // fields of the header
    std::size_t width_ = 0;       // fields of the header that have a name; 0 without one
    bool numbers_rows_ = false;   // in a column before these
    char decimal_mark_ = 0;       // of the numbers so far; 0: none had one
    std::uint64_t decimal_line_ = 0;
};

}  // namespace merl
