#pragma once

#include <string>
#include <string_view>

namespace merl::app {

/// The text with every byte that is not UTF-8 as \xNN. A backslash before an x becomes \x5c, so
/// that different texts stay different.
std::string as_utf8(std::string_view text);

/// The text that as_utf8 made this of.
std::string from_utf8(std::string_view text);

/// as_utf8 with control characters as \xNN too, and with those that are not seen but change how
/// others are (the order of writing, joining, nothing at all): on one line, harmless to a terminal,
/// and what looks the same is the same.
std::string printable(std::string_view text);

/// The characters that `printable` does not let through but for tabs and line ends, which are
/// nothing in a page: what stands in the brackets of a regular expression of JavaScript with the
/// flag u.
std::string hidden_in_pages();

/// Writes one line, `printable`, to standard output. Throws Error (output) when that fails. Where
/// standard output is a pipe that nobody reads any more (`| head`) nothing is written and nothing
/// is wrong.
void print_line(std::string_view text);

/// Writes the lines of a text, like print_line; each ends with a line feed, the last perhaps
/// without.
void print_lines(std::string_view text);

/// Writes a line of a summary, the text in a column beside its name.
void print_result(std::string_view name, std::string_view text);

/// Writes one line, `printable`, of what the user should know of their input to standard error.
void print_warning(std::string_view text);

/// Sees to it that what went to standard output arrived. Throws Error (output) like print_line.
void flush_output();

}  // namespace merl::app
