#include "engine/device/devices.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <string_view>
#include <utility>

#include "engine/base/error.h"
#include "engine/device/buffer_handles.h"
#include "engine/device/descriptions.h"
#include "engine/device/handles.h"
#include "engine/device/instance.h"

namespace merl::device {
namespace {

constexpr const char* kMemoryBudget = VK_EXT_MEMORY_BUDGET_EXTENSION_NAME;

std::string kind_text(vk::PhysicalDeviceType type) {
    switch (type) {
        case vk::PhysicalDeviceType::eDiscreteGpu:
            return "discrete GPU";
        case vk::PhysicalDeviceType::eIntegratedGpu:
            return "integrated GPU";
        case vk::PhysicalDeviceType::eVirtualGpu:
            return "virtual GPU";
        case vk::PhysicalDeviceType::eCpu:
            return "CPU";
        default:
            return "other";
    }
}

/// Lower is better: the order in which devices are preferred. What a driver says of its kind does
/// not make it fast when it computes on the processor, nor right when nobody has tested it.
std::pair<bool, int> preference(const DeviceInfo& info) {
    constexpr std::array<std::string_view, 4> order = {"discrete GPU", "integrated GPU",
                                                       "virtual GPU", "CPU"};
    const std::string_view kind = info.limits.is_host ? order.back() : info.kind;
    return {!info.is_conformant,
            static_cast<int>(std::find(order.begin(), order.end(), kind) - order.begin())};
}

bool is_software(vk::PhysicalDeviceType kind, vk::DriverId driver) {
    return kind == vk::PhysicalDeviceType::eCpu || driver == vk::DriverId::eMesaLlvmpipe ||
           driver == vk::DriverId::eGoogleSwiftshader;
}

constexpr std::uint32_t kAmd = 0x1002;
constexpr std::uint32_t kIntel = 0x8086;
constexpr std::uint32_t kNvidia = 0x10de;

/// Intel's GPUs have half as many registers for a lane where a subgroup has 32.
constexpr std::uint32_t kIntelLanes = 16;

/// docs/performance.md, "Other devices".
TileSides tile_sides(std::uint32_t vendor, bool is_host) {
    if (is_host) {
        return {.power = 10, .square = 10};
    }
    switch (vendor) {
        case kNvidia:
            return {.power = 6, .square = 8};
        case kIntel:
            return {.power = 3, .square = 4};
        case kAmd:
        default:
            return {.power = 6, .square = 6};
    }
}

/// What the limits say of memory.
void describe_memory(const vk::raii::PhysicalDevice& physical, Limits& limits) {
    const auto memory = physical.getMemoryProperties();
    std::uint32_t largest = memory.memoryHeapCount;  // of those of the device
    for (std::uint32_t i = 0; i < memory.memoryHeapCount; ++i) {
        if ((memory.memoryHeaps[i].flags & vk::MemoryHeapFlagBits::eDeviceLocal) &&
            memory.memoryHeaps[i].size > limits.heap_bytes) {
            limits.heap_bytes = memory.memoryHeaps[i].size;
            largest = i;
        }
    }
    // Others use it too; where the driver does not say how much, a fifth is theirs.
    limits.free_bytes = limits.heap_bytes / 5 * 4;
    if (largest < memory.memoryHeapCount && has_extension(physical, kMemoryBudget)) {
        const auto budget = physical
                                .getMemoryProperties2<vk::PhysicalDeviceMemoryProperties2,
                                                      vk::PhysicalDeviceMemoryBudgetPropertiesEXT>()
                                .get<vk::PhysicalDeviceMemoryBudgetPropertiesEXT>();
        const auto most = std::min(budget.heapBudget[largest], limits.heap_bytes);
        limits.free_bytes = most - std::min(most, budget.heapUsage[largest]);
    }
    const auto host_reaches_little = [&](vk::MemoryPropertyFlags wanted) {
        std::uint64_t reached = 0;
        for (std::uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
            const auto& type = memory.memoryTypes[i];
            if ((type.propertyFlags & wanted) == wanted) {
                reached = std::max<std::uint64_t>(reached, memory.memoryHeaps[type.heapIndex].size);
            }
        }
        return reached < limits.heap_bytes / 2;
    };
    limits.stages_uploads = host_reaches_little(shared_memory(Traffic::upload));
    limits.stages_downloads = host_reaches_little(shared_memory(Traffic::download));
}

FloatControls describe_floats(const vk::PhysicalDeviceVulkan12Properties& v12, bool float64) {
    FloatControls floats = {.float64 = float64};
    // Widths that are not independent are told the same, or nothing.
    floats.both_to_nearest =
        float64 && v12.roundingModeIndependence == vk::ShaderFloatControlsIndependence::eNone;
    floats.to_nearest = v12.shaderRoundingModeRTEFloat32 &&
                        (!floats.both_to_nearest || v12.shaderRoundingModeRTEFloat64);
    floats.keeps_nan = v12.shaderSignedZeroInfNanPreserveFloat32;
    return floats;
}

DeviceInfo describe(const vk::raii::PhysicalDevice& physical, std::uint32_t index) {
    DeviceInfo info;
    info.index = index;
    const auto basic = physical.getProperties();
    info.name = basic.deviceName.data();
    info.kind = kind_text(basic.deviceType);
    info.vulkan = version_text(basic.apiVersion);
    if (basic.apiVersion < kVulkanVersion) {
        info.refusal = fmt::format("it offers Vulkan {}, and 1.2 is needed", info.vulkan);
        return info;
    }
    const auto chain =
        physical.getProperties2<vk::PhysicalDeviceProperties2, vk::PhysicalDeviceVulkan11Properties,
                                vk::PhysicalDeviceVulkan12Properties>();
    const auto& limits = chain.get<vk::PhysicalDeviceProperties2>().properties.limits;
    const auto& v11 = chain.get<vk::PhysicalDeviceVulkan11Properties>();
    const auto& v12 = chain.get<vk::PhysicalDeviceVulkan12Properties>();
    info.driver = fmt::format("{} ({})", v12.driverName.data(), v12.driverInfo.data());
    info.is_conformant = v12.conformanceVersion != vk::ConformanceVersion();
    info.limits.is_host = is_software(basic.deviceType, v12.driverID);
    info.limits.tiles = tile_sides(basic.vendorID, info.limits.is_host);
    info.limits.storage_buffer_bytes = limits.maxStorageBufferRange;
    info.limits.texel_buffer_texels = limits.maxTexelBufferElements;
    info.limits.allocation_bytes = v11.maxMemoryAllocationSize;
    info.limits.groups_x = limits.maxComputeWorkGroupCount[0];
    info.limits.groups_y = limits.maxComputeWorkGroupCount[1];
    info.limits.subgroup_size = v11.subgroupSize;
    if (basic.vendorID == kIntel && allowed_subgroup_size(physical, kIntelLanes)) {
        info.limits.subgroup_size = kIntelLanes;
    }
    info.limits.floats = describe_floats(v12, physical.getFeatures().shaderFloat64);
    info.limits.floats.adds_float64 = info.limits.floats.float64 && info.limits.is_host;
    describe_memory(physical, info.limits);
    const auto texels = [&](vk::Format format) {
        return (physical.getFormatProperties(format).bufferFeatures &
                vk::FormatFeatureFlagBits::eUniformTexelBuffer) ==
               vk::FormatFeatureFlagBits::eUniformTexelBuffer;
    };
    const auto subgroup =
        vk::SubgroupFeatureFlagBits::eBasic | vk::SubgroupFeatureFlagBits::eArithmetic;
    if (!compute_queue_family(physical)) {
        info.refusal = "it has no compute queue";
    } else if ((v11.subgroupSupportedOperations & subgroup) != subgroup ||
               !(v11.subgroupSupportedStages & vk::ShaderStageFlagBits::eCompute)) {
        info.refusal = "it has no subgroup arithmetic in compute shaders";
    } else if (!texels(vk::Format::eR32G32B32A32Sfloat) || !texels(vk::Format::eR32G32B32A32Uint)) {
        info.refusal = "it cannot read texel buffers of four 32-bit numbers";
    }
    return info;
}

}  // namespace

std::optional<std::uint32_t> compute_queue_family(const vk::raii::PhysicalDevice& physical) {
    const auto families = physical.getQueueFamilyProperties();
    for (std::uint32_t i = 0; i < families.size(); ++i) {
        if (families[i].queueFlags & vk::QueueFlagBits::eCompute) {
            return i;
        }
    }
    return std::nullopt;
}

std::optional<std::uint32_t> transfer_queue_family(const vk::raii::PhysicalDevice& physical) {
    using Flag = vk::QueueFlagBits;
    const auto families = physical.getQueueFamilyProperties();
    for (std::uint32_t i = 0; i < families.size(); ++i) {
        if ((families[i].queueFlags & ~(Flag::eSparseBinding | Flag::eProtected)) ==
            Flag::eTransfer) {
            return i;
        }
    }
    return std::nullopt;
}

bool has_extension(const vk::raii::PhysicalDevice& physical, std::string_view name) {
    const auto extensions = physical.enumerateDeviceExtensionProperties();
    return std::any_of(extensions.begin(), extensions.end(),
                       [&](const auto& e) { return name == e.extensionName.data(); });
}

bool allowed_subgroup_size(const vk::raii::PhysicalDevice& physical, std::uint32_t lanes) {
    if (!has_extension(physical, kSubgroupSizeControl)) {
        return false;
    }
    const auto offered = physical
                             .getFeatures2<vk::PhysicalDeviceFeatures2,
                                           vk::PhysicalDeviceSubgroupSizeControlFeatures>()
                             .get<vk::PhysicalDeviceSubgroupSizeControlFeatures>();
    const auto sizes = physical
                           .getProperties2<vk::PhysicalDeviceProperties2,
                                           vk::PhysicalDeviceSubgroupSizeControlProperties>()
                           .get<vk::PhysicalDeviceSubgroupSizeControlProperties>();
    return offered.subgroupSizeControl && offered.computeFullSubgroups &&
           (sizes.requiredSubgroupSizeStages & vk::ShaderStageFlagBits::eCompute) &&
           sizes.minSubgroupSize <= lanes && lanes <= sizes.maxSubgroupSize;
}

std::vector<DeviceInfo> describe_all(const std::vector<vk::raii::PhysicalDevice>& physical,
                                     std::span<const Trial> trials) {
    std::vector<DeviceInfo> devices;
    for (std::uint32_t i = 0; i < physical.size(); ++i) {
        auto& device = devices.emplace_back(describe(physical[i], i));
        const Trial* const trial = trial_of(device, trials);
        if (trial == nullptr) {
            continue;
        }
        if (!device.refusal && !trial->refusal.empty()) {
            device.refusal = trial->refusal;
        }
        device.limits.tiles = trial->tiles.value_or(device.limits.tiles);
    }
    return devices;
}

std::size_t choose_device(const std::vector<DeviceInfo>& devices, const std::string& wanted) {
    if (devices.empty()) {
        throw why_no_device();
    }
    std::string list;
    for (const auto& d : devices) {
        list += fmt::format("{}{}: {} ({}){}", list.empty() ? "" : "; ", d.index, d.name, d.kind,
                            d.refusal ? ", cannot be used: " + *d.refusal : "");
    }
    const auto lower = [](std::string text) {
        std::transform(text.begin(), text.end(), text.begin(),
                       [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
        return text;
    };
    const bool is_index =
        !wanted.empty() && wanted.find_first_not_of("0123456789") == std::string::npos;
    std::vector<std::size_t> matches;
    for (std::size_t i = 0; i < devices.size(); ++i) {
        const bool named = lower(devices[i].name).find(lower(wanted)) != std::string::npos;
        if (is_index ? std::to_string(devices[i].index) == wanted : named) {
            matches.push_back(i);
        }
    }
    if (!wanted.empty()) {
        if (matches.empty()) {
            throw Error(
                Fault::device,
                fmt::format("no Vulkan device is called \"{}\"; there are: {}", wanted, list));
        }
        if (matches.size() > 1) {
            throw Error(Fault::device,
                        fmt::format("\"{}\" fits {} Vulkan devices; give an index: {}", wanted,
                                    matches.size(), list));
        }
        if (const auto& refusal = devices[matches[0]].refusal) {
            throw Error(Fault::device, fmt::format("Vulkan device {} ({}) cannot be used: {}",
                                                   wanted, devices[matches[0]].name, *refusal));
        }
        return matches[0];
    }
    std::erase_if(matches, [&](std::size_t i) { return devices[i].refusal.has_value(); });
    if (matches.empty()) {
        throw Error(Fault::device, fmt::format("no usable Vulkan device; there are: {}", list));
    }
    return *std::min_element(matches.begin(), matches.end(), [&](std::size_t a, std::size_t b) {
        return preference(devices[a]) < preference(devices[b]);
    });
}

std::string identity(const DeviceInfo& device) {
    return fmt::format("{}, {}, Vulkan {}", device.name, device.driver, device.vulkan);
}

const Trial* trial_of(const DeviceInfo& device, std::span<const Trial> trials) {
    const auto found = std::ranges::find(trials, identity(device), &Trial::device);
    return found == trials.end() ? nullptr : &*found;
}

std::vector<DeviceInfo> list_devices(std::span<const Trial> trials) {
    const auto loader = make_loader();
    const auto instance = guarded("vkCreateInstance", [&] { return make_instance(loader, ""); });
    auto devices = describe_all(enumerate(instance), trials);
    if (devices.empty()) {
        throw why_no_device();
    }
    return devices;
}

void widen_lavapipe() {
#if defined(__x86_64__)
    if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
        __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl")) {
        setenv("LP_NATIVE_VECTOR_WIDTH", "512", /*overwrite=*/0);
    }
#endif
}

}  // namespace merl::device
