#pragma once

#include <chrono>
#include <string>

namespace merl::app {

/// One line on the terminal with the share done and an estimate of the time left. It appears after
/// a second, only when standard error is a terminal, and goes away at the end.
class Progress {
  public:
    /// With `quiet` nothing is ever shown.
    Progress(std::string title, bool quiet);
    ~Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;

    /// `share` from 0 to 1. Throws Interrupted when the user wants to stop.
    void update(double share);

  private:
    std::string title_;
    bool visible_;
    std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// Takes the line off the terminal until the next update, whichever Progress has shown it, on any
/// thread.
void clear_progress();

}  // namespace merl::app
