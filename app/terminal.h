#pragma once

#include <string>
#include <string_view>

namespace merl::app {

/// The text with every byte that is not UTF-8 as \xNN. A backslash before an x becomes \x5c, so
/// that different texts stay different.
std::string as_utf8(std::string_view text);

/// as_utf8 with control characters as \xNN too: on one line, and harmless to a terminal.
std::string printable(std::string_view text);

/// Writes one line, `printable`, to standard output. Throws Error (output) when that fails.
void print_line(std::string_view text);

/// Writes the lines of a text, like print_line; each ends with a line feed, the last perhaps
/// without.
void print_lines(std::string_view text);

/// Writes a line of a summary, the text in a column beside its name.
void print_result(std::string_view name, std::string_view text);

/// Sees to it that what went to standard output arrived. Throws Error (output) like print_line.
void flush_output();

}  // namespace merl::app
