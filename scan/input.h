#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

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

}  // namespace merl::scan
