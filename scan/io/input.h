#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <string>
#include <string_view>

#include "engine/base/error.h"

namespace merl::scan {

/// How the hidden directory begins in which a run has its results until they are whole, and which a
/// run that was killed leaves beside them.
inline constexpr std::string_view stopped_run_prefix = ".merl-scan.partial-";

/// "; a run that was stopped left results in ..." where there is such a directory beside a file
/// that is missing, otherwise nothing.
std::string stopped_run_beside(const std::string& path);

/// The largest text that is read: a thousand materials under forty metrics.
inline constexpr std::uint64_t max_input_bytes = std::uint64_t{1} << 30U;

/// Most configurations of a selection and trials of a kit or a judge; no judge sees a thousandth of
/// them.
inline constexpr std::size_t max_trials = 100'000;

/// The largest file about what judges are to see or have seen: `max_trials` of them.
inline constexpr std::uint64_t max_trials_bytes = std::uint64_t{1} << 28U;

/// The bytes of a regular file. Throws InputError when it cannot be read, is empty or has more than
/// `most` bytes.
std::string read_input(const std::string& path, std::uint64_t most = max_input_bytes);

/// What the JSON parser says is wrong: line, column and what it expected, without its own code.
std::string_view json_fault(const std::exception& error);

}  // namespace merl::scan
