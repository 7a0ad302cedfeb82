#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "engine/device/devices.h"
#include "engine/device/vulkan.h"

namespace merl::device {

/// What is needed of the loader and of devices.
inline constexpr std::uint32_t kVulkanVersion = VK_API_VERSION_1_2;

/// "1.2.0".
std::string version_text(std::uint32_t version);

/// The loader. Throws NoDriverError that says how to get it.
vk::raii::Context make_loader();

/// What MERL_SCAN_VALIDATE in the environment asks for; empty without it.
std::string validation_mode();

/// An instance, with the validation layer where `validate` is not empty; null where the loader
/// finds no driver. Throws Error (device).
vk::raii::Instance make_instance(const vk::raii::Context& loader, const std::string& validate);

/// The devices of an instance, which may be null.
std::vector<vk::raii::PhysicalDevice> enumerate(const vk::raii::Instance& instance);

/// Why there is no device at all.
NoDriverError why_no_device();

}  // namespace merl::device
