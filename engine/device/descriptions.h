#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "engine/device/devices.h"
#include "engine/device/vulkan.h"

namespace merl::device {

/// The first family of queues that compute.
std::optional<std::uint32_t> compute_queue_family(const vk::raii::PhysicalDevice& physical);

/// The first family of queues that copy and do nothing else: a card copies with them while it
/// computes.
std::optional<std::uint32_t> transfer_queue_family(const vk::raii::PhysicalDevice& physical);

bool has_extension(const vk::raii::PhysicalDevice& physical, std::string_view name);

/// What there is, in the order of the loader.
std::vector<DeviceInfo> describe_all(const std::vector<vk::raii::PhysicalDevice>& physical);

}  // namespace merl::device
