#pragma once

#include <exception>

namespace merl::app {

/// Thrown when the user asked the program to stop (SIGINT, SIGTERM or SIGHUP).
class Interrupted : public std::exception {
  public:
    explicit Interrupted(int signal) : signal_(signal) {}
    int signal() const { return signal_; }
    const char* what() const noexcept override { return "interrupted"; }

  private:
    int signal_;
};

/// From now on SIGINT, SIGTERM and, unless it was ignored, SIGHUP are only noted, and writing to a
/// closed pipe or beyond the largest file allowed is an error like any other: nothing half-written
/// is left behind.
void catch_interrupts();

/// Throws Interrupted when a signal was noted. Called between pieces of work.
void throw_if_interrupted();

}  // namespace merl::app
