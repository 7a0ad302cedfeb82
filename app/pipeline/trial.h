#pragma once

#include "engine/device/context.h"

namespace merl::pipeline {

/// Tries the Vulkan device that a context opens. Distances of made-up materials under a metric of
/// each kind have to be within their bounds of float64. Of a GPU it measures in which tiles it is
/// fastest, and where it has no memory of its own whether the host engine is faster. It takes
/// seconds. Throws what opening and computing throw; what is wrong with the device is in the
/// result. A bad driver may crash or hang: a program runs this in a process of its own.
device::Trial try_device(const device::ContextOptions& options);

}  // namespace merl::pipeline
