#pragma once

#include <span>

#include "engine/device/context.h"
#include "engine/metric/metric.h"

namespace merl::app {

/// Compiles each user's metric and tries it on the device, in a process of its own (guard.h: call
/// this before a device is opened), so that none can hang or crash the program. Throws Error
/// (input) for a file that cannot be used, and what pipeline::try_metric() throws.
void try_metrics(std::span<const engine::Metric* const> metrics,
                 const device::ContextOptions& device);

}  // namespace merl::app
