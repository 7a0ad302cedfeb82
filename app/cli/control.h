#pragma once

#include <memory>
#include <string>

#include "app/cli/progress.h"
#include "app/pipeline/control.h"

namespace merl::app {

/// Shows the stages of work on the terminal, one after the other, and ends it when the user wants
/// to stop.
class TerminalControl {
  public:
    /// With `quiet` nothing is ever shown.
    explicit TerminalControl(bool quiet) : quiet_(quiet) {}

    /// For the functions of pipeline/, as long as this lives. Its progress throws Interrupted.
    pipeline::Control control();

    /// Takes the line off the terminal until the next stage.
    void clear() { progress_.reset(); }

  private:
    bool quiet_;
    std::string stage_;
    std::unique_ptr<Progress> progress_;
};

}  // namespace merl::app
