#pragma once

#include <cstdint>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>

namespace merl::scan {

/// A file of the user's that cannot be used: its name, the line, what was found, what was expected.
class InputError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// The largest text that is read: a thousand materials under forty metrics.
inline constexpr std::uint64_t max_input_bytes = std::uint64_t{1} << 30U;

/// The bytes of a regular file. Throws InputError when it cannot be read, is empty or has more than
/// `max_input_bytes`.
std::string read_input(const std::string& path);

/// What the JSON parser says is wrong: line, column and what it expected, without its own code.
std::string_view json_fault(const std::exception& error);

}  // namespace merl::scan
