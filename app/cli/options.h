#pragma once

#include <CLI/CLI.hpp>
#include <cstdint>
#include <string>

#include "scan/statistics/bootstrap.h"

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

/// Adds --out and --force of a command that writes a directory of results. Returns --out.
CLI::Option* add_output_options(CLI::App& command, std::string& out, bool& force);

/// Adds --selection; `what` is what it stands for.
CLI::Option* add_selection_option(CLI::App& command, std::string& selection,
                                  const std::string& what);

/// Adds --force; `what` is what it does.
void add_force_option(CLI::App& command, bool& force,
                      const char* what = "Replace the results in an existing directory");

/// Adds --quiet; `what` is what there is none of then.
void add_quiet_option(CLI::App& command, bool& quiet,
                      const char* what = "No progress and no summary");

/// Adds --replicates and --seed.
void add_bootstrap_options(CLI::App& command, scan::BootstrapOptions& options);

}  // namespace merl::app
