#pragma once

#include <exception>
#include <functional>
#include <stop_token>
#include <string_view>

namespace merl::pipeline {

/// Thrown by work that was asked to stop (Control::stop).
class Cancelled : public std::exception {
  public:
    const char* what() const noexcept override { return "cancelled"; }
};

/// How a caller follows long work and ends it. Work looks at it between pieces, within a second but
/// for compilers, drivers and what a function says of itself.
struct Control {
    /// Called with the stage that is at work ("distances", "refining" ...) and the share of it that
    /// is done, from 0 to 1, one call at a time. What it throws ends the work and comes out.
    std::function<void(std::string_view stage, double share)> progress = {};
    std::stop_token stop = {};

    void update(std::string_view stage, double share) const {
        if (stop.stop_requested()) {
            throw Cancelled();
        }
        if (progress) {
            progress(stage, share);
        }
    }

    /// The progress of one stage, as the functions of engine/ and scan/ take it.
    std::function<void(double share)> stage(std::string_view name) const {
        return [this, name](double share) { update(name, share); };
    }
};

}  // namespace merl::pipeline
