#pragma once

#include "engine/device/context.h"

namespace merl::device {

/// Runs a workgroup of as many invocations as the device says that a subgroup has, and throws
/// UnfitError unless they are one subgroup: kernels that add up lanes would give part of each sum.
/// To be asked where pipelines cannot say how large their subgroups are.
void check_subgroups(Context& context);

}  // namespace merl::device
