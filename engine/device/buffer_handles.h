#pragma once

#include <optional>
#include <vector>

#include "engine/device/buffer.h"
#include "engine/device/handles.h"

namespace merl::device {

/// Memory that kernels use at full speed and the host maps; reading back also wants a cache. It
/// need not be coherent.
vk::MemoryPropertyFlags shared_memory(Traffic traffic);

/// One Vulkan buffer with its memory; the count of allocated bytes follows its life.
struct Allocation {
    /// Memory has `wanted` where there is such, else `needed`. What the host maps is coherent where
    /// one can choose. `families` are those of the queues that use it, where there are several.
    Allocation(Context::Handles& context, std::uint64_t bytes, vk::BufferUsageFlags usage,
               vk::MemoryPropertyFlags wanted, vk::MemoryPropertyFlags needed,
               const std::vector<std::uint32_t>& families = {});
    ~Allocation();
    Allocation(const Allocation&) = delete;
    Allocation& operator=(const Allocation&) = delete;

    /// All of it where it is mapped and not coherent, for flushing and invalidating.
    std::optional<vk::MappedMemoryRange> incoherent() const;

    Context::Handles& context;
    std::uint64_t allocated = 0;
    vk::raii::DeviceMemory memory = nullptr;
    vk::raii::Buffer buffer = nullptr;
    std::byte* mapped = nullptr;
    bool coherent = false;
};

struct Buffer::Handles {
    std::uint64_t bytes = 0;
    Traffic traffic = Traffic::none;
    std::unique_ptr<Allocation> device;
    std::unique_ptr<Allocation> staging;  // null when the device's own memory is mapped
    vk::raii::BufferView texels = nullptr;

    /// What the host maps.
    const Allocation& host() const { return staging ? *staging : *device; }
};

}  // namespace merl::device
