#pragma once

#include "engine/device/context.h"

namespace merl::pipeline {

/// Tries the Vulkan device that a context opens. Of a GPU it measures in which tiles of pairs it is
/// fastest. Then distances of some materials under metrics of each kind, in those tiles, have to be
/// within their bounds of float64. A GPU that does not call itself discrete is timed beside the
/// host engine. It takes seconds. Throws what opening and computing throw; what is wrong with the
/// device is in the result. A bad driver may crash or hang: a program runs this in a process of its
/// own.
device::Trial try_device(const device::ContextOptions& options);

}  // namespace merl::pipeline
