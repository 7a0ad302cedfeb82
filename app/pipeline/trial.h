#pragma once

#include "engine/device/context.h"

namespace merl::pipeline {

/// Tries the Vulkan device that a context opens: distances of made-up materials under a metric of
/// each kind have to be within their bounds of float64, and a GPU in the processor's own memory is
/// timed beside the host engine: returns whether that is faster. It takes a second or so. Throws
/// what opening and computing throw, and UnfitError for a distance that is wrong. A bad driver may
/// crash or hang: a program runs this in a process of its own.
bool loses_to_host(const device::ContextOptions& options);

}  // namespace merl::pipeline
