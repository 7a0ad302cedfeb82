#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace merl::app {

/// Writes one line, printable() (engine/base/text.h), to standard output. Throws Error (output)
/// when that fails. Where standard output is a pipe that nobody reads any more (`| head`) nothing
/// is written and nothing is wrong.
void print_line(std::string_view text);

/// Writes the lines of a text, like print_line; each ends with a line feed, the last perhaps
/// without.
void print_lines(std::string_view text);

/// Writes a line of a summary, the text in a column beside its name.
void print_result(std::string_view name, std::string_view text);

/// Writes one line, printable(), of what the user should know of their input to standard error.
void print_warning(std::string_view text);

/// So many columns a text takes when print_line has made it harmless.
std::size_t width_of(std::string_view text);

/// A text with spaces after it, up to a width.
std::string padded(std::string_view text, std::size_t width);

/// Sees to it that what went to standard output arrived. Throws Error (output) like print_line.
void flush_output();

}  // namespace merl::app
