#pragma once

#include <stdexcept>
#include <string>

namespace merl {

/// Whose fault an error is; the command line turns it into its exit status.
enum class Fault { usage, input, device, output, resource };

/// One clear line for the user: the thing, what was found, what was expected, what to do.
class Error : public std::runtime_error {
  public:
    Error(Fault fault, const std::string& message) : std::runtime_error(message), fault_(fault) {}
    Fault fault() const { return fault_; }

  private:
    Fault fault_;
};

/// The user's fault: a file that cannot be used, with its name, the place, what was found, what was
/// expected.
class InputError : public Error {
  public:
    explicit InputError(const std::string& message) : Error(Fault::input, message) {}
};

/// More memory is needed than is allowed.
class MemoryError : public Error {
  public:
    explicit MemoryError(const std::string& message) : Error(Fault::usage, message) {}
};

}  // namespace merl
