#include "engine/device/buffer.h"

#include <fmt/format.h>

#include <optional>

#include "engine/base/error.h"
#include "engine/device/buffer_handles.h"

namespace merl::device {
namespace {

using Property = vk::MemoryPropertyFlagBits;

/// The first memory type among `allowed` (a bit per type) that has all `wanted` properties.
std::optional<std::uint32_t> memory_type(const vk::PhysicalDeviceMemoryProperties& memory,
                                         std::uint32_t allowed, vk::MemoryPropertyFlags wanted) {
    for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
        if ((allowed >> i & 1U) != 0 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) {
            return i;
        }
    }
    return std::nullopt;
}

// What the host maps, in this order of preference:
//
//   it writes, mapped    the device's own memory
//   it reads, mapped     the device's own memory, with a cache: without one, reading takes longer
//                        than copying
//   it writes, a copy    any that it reaches
//   it reads, a copy     memory with a cache, or any that it reaches
//
// Of each the first type that is coherent, and otherwise the first that is not, which has to be
// flushed and invalidated: on mobile GPUs only such memory has a cache.
constexpr vk::MemoryPropertyFlags kHostVisible = Property::eHostVisible;

}  // namespace

vk::MemoryPropertyFlags shared_memory(Traffic traffic) {
    auto wanted = kHostVisible | Property::eDeviceLocal;
    if (traffic == Traffic::download) {
        wanted |= Property::eHostCached;
    }
    return wanted;
}

Allocation::Allocation(Context::Handles& context_, std::uint64_t bytes, vk::BufferUsageFlags usage,
                       vk::MemoryPropertyFlags wanted, vk::MemoryPropertyFlags needed,
                       const std::vector<std::uint32_t>& families)
    : context(context_) {
    const auto sharing =
        families.empty() ? vk::SharingMode::eExclusive : vk::SharingMode::eConcurrent;
    buffer = {context.device, vk::BufferCreateInfo({}, bytes, usage, sharing, families)};
    const auto needs = buffer.getMemoryRequirements();
    const bool host_visible = static_cast<bool>(needed & Property::eHostVisible);
    std::optional<std::uint32_t> type;
    for (const auto flags : {wanted, needed}) {  // a cache, or being local, is a wish
        if (!type && host_visible) {
            type =
                memory_type(context.memory, needs.memoryTypeBits, flags | Property::eHostCoherent);
        }
        if (!type) {
            type = memory_type(context.memory, needs.memoryTypeBits, flags);
        }
    }
    if (!type) {
        throw Error(Fault::device, fmt::format("{} has no memory for buffers{}", context.info.name,
                                               host_visible ? " that the host can reach" : ""));
    }
    try {
        memory = {context.device, {needs.size, *type}};
    } catch (const vk::SystemError& error) {
        throw AllocationError(
            fmt::format("{} cannot allocate {:.1f} MiB ({:.1f} MiB are in use): {}",
                        context.info.name, static_cast<double>(needs.size) / 1048576.0,
                        static_cast<double>(context.allocated) / 1048576.0, error.what()));
    }
    allocated = needs.size;
    context.allocated += allocated;
    context.peak_allocated = std::max(context.peak_allocated, context.allocated);
    buffer.bindMemory(*memory, 0);
    if (host_visible) {
        coherent = static_cast<bool>(context.memory.memoryTypes[*type].propertyFlags &
                                     Property::eHostCoherent);
        mapped = static_cast<std::byte*>(memory.mapMemory(0, VK_WHOLE_SIZE));
    }
}

Allocation::~Allocation() {
    context.allocated -= allocated;
}

std::optional<vk::MappedMemoryRange> Allocation::incoherent() const {
    if (mapped == nullptr || coherent) {
        return std::nullopt;
    }
    return vk::MappedMemoryRange(*memory, 0, VK_WHOLE_SIZE);
}

Buffer::Buffer(Context& context, std::uint64_t bytes, Traffic traffic, Texels texels)
    : handles_(std::make_unique<Handles>()) {
    using Usage = vk::BufferUsageFlagBits;
    auto& c = context.handles();
    auto& h = *handles_;
    h.bytes = bytes;
    h.traffic = traffic;
    if (bytes == 0 || bytes > c.info.limits.storage_buffer_bytes ||
        (texels != Texels::none && bytes / 16 > c.info.limits.texel_buffer_texels)) {
        throw std::logic_error(fmt::format("a buffer of {} bytes was planned; {} allows 1 to {}",
                                           bytes, c.info.name, c.info.limits.storage_buffer_bytes));
    }
    guarded("creating a buffer", [&] {
        vk::BufferUsageFlags usage = Usage::eStorageBuffer;
        if (texels != Texels::none) {
            usage |= Usage::eUniformTexelBuffer;
        }
        if (traffic == Traffic::none) {
            h.device = std::make_unique<Allocation>(c, bytes, usage, Property::eDeviceLocal,
                                                    vk::MemoryPropertyFlags());
        } else if (!(traffic == Traffic::upload ? c.info.limits.stages_uploads
                                                : c.info.limits.stages_downloads)) {
            try {
                h.device = std::make_unique<Allocation>(c, bytes, usage, shared_memory(traffic),
                                                        kHostVisible);
            } catch (const AllocationError&) {
                // What the host reaches is full, which other memory need not be.
            }
        }
        if (!h.device) {
            const bool up = traffic == Traffic::upload;
            std::vector<std::uint32_t> families;
            if (up && c.transfer_family) {
                families = {c.queue_family, *c.transfer_family};
            }
            h.device = std::make_unique<Allocation>(
                c, bytes, usage | (up ? Usage::eTransferDst : Usage::eTransferSrc),
                Property::eDeviceLocal, vk::MemoryPropertyFlags(), families);
            h.staging = std::make_unique<Allocation>(
                c, bytes, up ? Usage::eTransferSrc : Usage::eTransferDst,
                up ? kHostVisible : kHostVisible | Property::eHostCached, kHostVisible);
        }
        if (texels != Texels::none) {
            h.texels = {c.device,
                        {{},
                         *h.device->buffer,
                         texels == Texels::floats ? vk::Format::eR32G32B32A32Sfloat
                                                  : vk::Format::eR32G32B32A32Uint,
                         0,
                         VK_WHOLE_SIZE}};
        }
    });
}

Buffer::~Buffer() = default;
Buffer::Buffer(Buffer&&) noexcept = default;
Buffer& Buffer::operator=(Buffer&&) noexcept = default;

std::uint64_t Buffer::bytes() const {
    return handles_->bytes;
}

std::span<std::byte> Buffer::host() const {
    const auto& h = *handles_;
    std::byte* data = h.host().mapped;
    return data ? std::span<std::byte>(data, h.bytes) : std::span<std::byte>();
}

}  // namespace merl::device
