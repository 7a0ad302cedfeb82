#pragma once

#include <string>
#include <string_view>

namespace merl::scan {

/// A CSV field as RFC 4180 has it: in quotes, with quotes doubled, where it holds a comma, a quote,
/// a carriage return or a line feed; as it is otherwise. A text that starts like a spreadsheet
/// formula is data like any other.
std::string csv_field(std::string_view text);

/// A CSV field for text that a stranger may have written, like a judge's comment: csv_field, with
/// an apostrophe before a text that a spreadsheet could take for a formula (one that begins with =
/// + - @, a tab or a carriage return), so that it stays text there.
std::string csv_free_text(std::string_view text);

/// Appends the shortest decimal number that reads back as the same double.
void append_number(std::string& out, double value);

/// Appends a comma and the number, which is left out where it is not one: there is no such figure.
void append_figure(std::string& out, double value);

/// Writes everything to a file descriptor. Throws std::system_error with the error of write(2).
void write_all(int file, std::string_view text);

}  // namespace merl::scan
