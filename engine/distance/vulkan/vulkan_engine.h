#pragma once

#include <memory>

#include "engine/device/context.h"
#include "engine/distance/parts/engine.h"

namespace merl::engine {

/// The engine on a Vulkan device: its shaders (shaders/framework/) do every step of every metric.
/// The context must outlive it.
std::unique_ptr<Engine> make_vulkan_engine(device::Context& context);

}  // namespace merl::engine
