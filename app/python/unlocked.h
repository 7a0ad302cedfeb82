#pragma once

#include <pybind11/pybind11.h>

namespace merl::python {

/// As long as it lives, other threads of Python run. Python ends a thread that asks for the lock
/// when the process ends, in the middle of C++, which aborts; so end_calls() waits for all of
/// these.
class Unlocked {
  public:
    Unlocked();
    ~Unlocked();
    Unlocked(const Unlocked&) = delete;
    Unlocked& operator=(const Unlocked&) = delete;

  private:
    PyThreadState* state_;
};

/// For the end of the process, with the lock: ends the calls of other threads, which raise
/// SystemExit as all later ones do, and returns when they have.
void end_calls();

}  // namespace merl::python
