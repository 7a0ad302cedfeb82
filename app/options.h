#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>

namespace merl::app {

// What option values must look like. CLI11's own conversions let negative, too large, empty, octal
// and hexadecimal numbers pass as something else. All are for CLI::Option::transform.

/// A whole number in decimal digits, from `least` to `most`.
CLI::Validator whole_number(std::uint64_t least, std::uint64_t most);

/// A decimal number from `least` to `most`.
CLI::Validator number(double least, double most);

/// A whole number of bytes, or one with a unit: K, M, G, T, P or E (powers of 1024; KB, KiB and
/// lower case are the same).
CLI::Validator byte_count();

/// Any text but none, which "$RESULTS" is when the shell has no such variable.
CLI::Validator not_empty();

}  // namespace merl::app
