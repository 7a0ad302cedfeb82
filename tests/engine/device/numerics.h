#pragma once

#include <cstdint>
#include <vector>

#include "engine/device/context.h"

namespace merl::device {

/// What numerics.comp computes.
enum Function : std::uint32_t { kCubeRoot, kTwoThirdsPower, kIdentity };

/// Runs one function of shaders/lib/numerics.glsl on the device.
std::vector<float> on_device(Context& context, Function function, const std::vector<float>& x);

}  // namespace merl::device
