#pragma once

#include "engine/device/buffer.h"
#include "engine/device/handles.h"

namespace merl::device {

/// Memory that kernels use at full speed and the host maps; reading back also wants a cache.
vk::MemoryPropertyFlags shared_memory(Traffic traffic);

/// One Vulkan buffer with its memory; the count of allocated bytes follows its life.
struct Allocation {
    Allocation(Context::Handles& context, std::uint64_t bytes, vk::BufferUsageFlags usage,
               vk::MemoryPropertyFlags wanted, bool host_visible);
    ~Allocation();
    Allocation(const Allocation&) = delete;
    Allocation& operator=(const Allocation&) = delete;

    Context::Handles& context;
    std::uint64_t allocated = 0;
    vk::raii::DeviceMemory memory = nullptr;
    vk::raii::Buffer buffer = nullptr;
    std::byte* mapped = nullptr;
};

struct Buffer::Handles {
    std::uint64_t bytes = 0;
    Traffic traffic = Traffic::none;
    std::unique_ptr<Allocation> device;
    std::unique_ptr<Allocation> staging;  // null when the device's own memory is mapped
    vk::raii::BufferView texels = nullptr;
};

}  // namespace merl::device
