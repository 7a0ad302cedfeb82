#pragma once

// The one place that includes Vulkan. Nothing outside engine/device includes this file.
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wshadow"
#pragma GCC diagnostic ignored "-Wpedantic"
#include <vulkan/vulkan_raii.hpp>
#pragma GCC diagnostic pop
