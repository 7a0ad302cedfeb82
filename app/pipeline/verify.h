#pragma once

#include <functional>
#include <string>

#include "app/pipeline/control.h"
#include "engine/device/context.h"
#include "engine/distance/parts/engine.h"

namespace merl::pipeline {

/// A number that was computed, held to what it should be.
struct Check {
    std::string name;
    std::string expected;  // as one reads them
    std::string actual;
    double error = 0;  // relative; of a count the difference
    double allowed = 0;

    bool passed() const { return error <= allowed; }  // false for NaN
};

/// What hears of the checks of an engine while they are done.
struct VerifySink {
    std::function<void(const engine::EngineDescription&)> engine;  // its checks follow
    std::function<void(const Check&)> check;
};

/// Checks an engine against the framework test of Ryman 2018, independent float64 distances of the
/// built-in database, and the float64 twins of the library. `device` is as for Engines; of no
/// device: the host engine, and the best Vulkan device if there is one. The stage is "built-in
/// database". Returns how many checks failed.
int verify(const device::ContextOptions& device, const VerifySink& sink,
           const Control& control = {});

}  // namespace merl::pipeline
