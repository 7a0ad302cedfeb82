#pragma once

#include <memory>
#include <span>
#include <string>

#include "app/pipeline/control.h"
#include "engine/device/context.h"
#include "engine/distance/engines.h"
#include "engine/metric/metric.h"

namespace merl::app {

// Drivers may crash when they are loaded, hang, or compute wrongly. So each set of drivers and each
// device is tried once, in a process of its own, before the program uses it, and what came of it is
// kept (known_devices.h). All of this is to be called before there are other threads or drivers are
// loaded (guard.h).

/// Any device, without a trial: for what tries devices itself. Drivers that crash are left out from
/// here on, with a warning. Of what is known the device is told in which tiles it is fast. Throws
/// Error (device) where no driver is left and one was asked for.
device::ContextOptions untried_device(const std::string& device);

/// The engines for these metrics, their device tried; the stage is "trying" and its name. Throws
/// what untried_device() throws, and Error (resource) where the memory of this process is too
/// limited for the driver.
std::unique_ptr<engine::Engines> tried_engines(const std::string& device,
                                               std::span<const engine::Metric* const> metrics,
                                               const pipeline::Control& control);

/// The device that a Context opens, tried likewise.
device::ContextOptions tried_device(const std::string& device, const pipeline::Control& control);

}  // namespace merl::app
