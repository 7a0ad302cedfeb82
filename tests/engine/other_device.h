#pragma once

#include <memory>
#include <string>

#include "engine/device/context.h"

namespace merl::test {

/// lavapipe below a layer that makes it look like another device (tests/vulkan_layer).
std::unique_ptr<device::Context> other_device(const std::string& changes);

}  // namespace merl::test
