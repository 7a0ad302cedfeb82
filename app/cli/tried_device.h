#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/device/context.h"
#include "engine/metric/metric.h"

namespace merl::app {

// Drivers may crash when they are loaded, hang, or compute wrongly. So each version of a driver and
// each device is tried once, in a process of its own, before the program uses it; what came of it
// is kept in the user's cache directory. All of this is to be called before there are other threads
// or an open device (guard.h).

/// $XDG_CACHE_HOME/merl-scan or ~/.cache/merl-scan; empty where there is no such place.
std::filesystem::path cache_directory();

/// What came of trying devices so far.
std::vector<device::Trial> known_trials();

/// Any device, without a trial: for what tries devices itself. Drivers that crash are left out from
/// here on, with a warning. Throws Error (device) where none is left and one was asked for.
device::ContextOptions untried_device(const std::string& device);

/// The device that these metrics are computed on (engine::Engines), tried. Throws what
/// untried_device() throws, and Error (resource) where the memory of this process is too limited
/// for the driver.
device::ContextOptions tried_device(const std::string& device,
                                    std::span<const engine::Metric* const> metrics);

/// The device that a Context opens, tried.
device::ContextOptions tried_device(const std::string& device);

}  // namespace merl::app
