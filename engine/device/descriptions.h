#pragma once

#include <cstdint>
#include <optional>
#include <span>
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

/// Whether a device offers an extension.
bool has_extension(const vk::raii::PhysicalDevice& physical, std::string_view name);

inline constexpr const char* kSubgroupSizeControl = VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME;

/// Whether a compute pipeline may ask for full subgroups of so many lanes.
bool allowed_subgroup_size(const vk::raii::PhysicalDevice& physical, std::uint32_t lanes);

/// What there is, in the order of the loader; refused where a trial says so, and with the tiles
/// that it measured.
std::vector<DeviceInfo> describe_all(const std::vector<vk::raii::PhysicalDevice>& physical,
                                     std::span<const Trial> trials);

}  // namespace merl::device
