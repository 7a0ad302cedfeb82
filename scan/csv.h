#pragma once

#include <string>
#include <string_view>

namespace merl::scan {

/// A CSV field as RFC 4180 has it: in quotes, with quotes doubled, where it holds a comma, a quote,
/// a carriage return or a line feed; as it is otherwise. A text that starts like a spreadsheet
/// formula is data like any other.
std::string csv_field(std::string_view text);

/// Appends the shortest decimal number that reads back as the same double.
void append_number(std::string& out, double value);

/// Writes everything to a file descriptor. Throws std::system_error with the error of write(2).
void write_all(int file, std::string_view text);

}  // namespace merl::scan
