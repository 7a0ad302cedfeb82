// A Vulkan layer that makes the device below it look like another one, so that what the program
// does on cards that nobody has at hand can be tested on lavapipe.
//
// MERL_SCAN_OTHER_DEVICE holds the changes, words with blanks between them (Settings). The layer
// stands next to the program: validation, which is below, sees the real device, so what another
// device would not allow is refused here.
#include <vulkan/vk_layer.h>
#include <vulkan/vulkan.h>

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>
#include <mutex>
#include <set>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace {

constexpr const char* kName = "VK_LAYER_MERL_SCAN_other_device";
constexpr const char* kPortabilitySubset = "VK_KHR_portability_subset";
constexpr char kNeverWritten = '\xa5';
constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20U;

struct Settings {
    std::string kind;                   // kind=discrete, integrated or virtual
    std::uint64_t heap = 0;             // heap=MIB of memory of its own
    std::uint64_t bar = 0;              // bar=MIB of that can be mapped; needs heap
    std::uint64_t fail_allocation = 0;  // fail-allocation=N: the Nth fails, and all after it
    std::uint64_t lose_at = 0;          // lose-at=N: the Nth submission finds the device lost
    std::uint64_t hang_at = 0;          // hang-at=N: the Nth submission and all after it never end
    std::uint64_t timestamp_bits = 64;  // timestamp-bits=N
    std::uint64_t groups = 0;           // groups=N: the most workgroups along x and y
    std::uint64_t groups_at_once = 0;   // groups-at-once=N: a submission of more loses the device
    std::uint64_t storage_buffer = 0;   // storage-buffer=MIB: the largest
    bool no_usable_memory = false;      // no-usable-memory: none that can be mapped
    bool transfer_queue = false;     // transfer-queue: a second family of queues, which only copy
    bool no_float64 = false;         // no-float64
    bool no_rounding_modes = false;  // no-rounding-modes: nor that NaN is kept
    bool non_coherent = false;       // non-coherent: what is mapped has to be flushed, invalidated
    std::uint64_t subgroup = 0;      // subgroup=N is what it says, and pipelines cannot choose
    bool software = false;           // software: a kind=... that computes on the processor
    bool untested = false;           // untested: a driver that is not conformant
    bool portability = false;        // portability: only for those who ask for such devices
    std::uint64_t wrong = 0;         // wrong=N: of N workgroups along x the last does nothing
};

std::uint64_t number(const std::string& word, const std::string& text) {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
        std::fprintf(stderr, "%s: MERL_SCAN_OTHER_DEVICE: found \"%s\", expected a number\n", kName,
                     word.c_str());
        std::abort();
    }
    return value;
}

Settings read_settings() {
    Settings s;
    const char* text = std::getenv("MERL_SCAN_OTHER_DEVICE");
    std::istringstream words(text != nullptr ? text : "");
    const std::map<std::string, std::uint64_t Settings::*> numbers = {
        {"heap", &Settings::heap},
        {"bar", &Settings::bar},
        {"fail-allocation", &Settings::fail_allocation},
        {"lose-at", &Settings::lose_at},
        {"hang-at", &Settings::hang_at},
        {"timestamp-bits", &Settings::timestamp_bits},
        {"groups", &Settings::groups},
        {"subgroup", &Settings::subgroup},
        {"wrong", &Settings::wrong},
        {"groups-at-once", &Settings::groups_at_once},
        {"storage-buffer", &Settings::storage_buffer}};
    const std::map<std::string, bool Settings::*> switches = {
        {"no-usable-memory", &Settings::no_usable_memory},
        {"transfer-queue", &Settings::transfer_queue},
        {"no-float64", &Settings::no_float64},
        {"no-rounding-modes", &Settings::no_rounding_modes},
        {"non-coherent", &Settings::non_coherent},
        {"software", &Settings::software},
        {"untested", &Settings::untested},
        {"portability", &Settings::portability}};
    for (std::string word; words >> word;) {
        const auto equals = word.find('=');
        const auto name = word.substr(0, equals);
        if (name == "kind" && equals != std::string::npos) {
            s.kind = word.substr(equals + 1);
        } else if (numbers.contains(name) && equals != std::string::npos) {
            s.*numbers.at(name) = number(word, word.substr(equals + 1));
        } else if (switches.contains(word)) {
            s.*switches.at(word) = true;
        } else {
            std::fprintf(stderr, "%s: MERL_SCAN_OTHER_DEVICE: \"%s\" is unknown\n", kName,
                         word.c_str());
            std::abort();
        }
    }
    return s;
}

const Settings& settings() {
    static const Settings read = read_settings();
    return read;
}

// ---- what is below -----------------------------------------------------------------------------

PFN_vkVoidFunction own_function(std::string_view name);
std::span<const std::string_view> own_names();

/// An instance or a device as it is below, with those of its functions that this layer has too.
/// They are looked up when it is made: later the loader would give this layer's.
template <typename Handle, typename Get>
struct Below {
    Handle handle = VK_NULL_HANDLE;
    Get get = nullptr;
    std::map<std::string_view, PFN_vkVoidFunction> functions = {};

    Below() = default;
    Below(Handle handle_, Get get_) : handle(handle_), get(get_) {
        for (const auto name : own_names()) {
            functions[name] = get(handle, name.data());
        }
    }

    template <typename Function>
    Function function(std::string_view name) const {
        return reinterpret_cast<Function>(functions.at(name));
    }
};
using InstanceBelow = Below<VkInstance, PFN_vkGetInstanceProcAddr>;
using DeviceBelow = Below<VkDevice, PFN_vkGetDeviceProcAddr>;

struct Memory {
    std::uint32_t heap;
    std::uint64_t bytes;
    bool can_be_mapped;
    // What the host maps of memory that is not coherent, and the real memory behind it.
    std::vector<char> shadow = {};
    char* real = nullptr;
};

std::mutex lock;
std::map<void*, InstanceBelow> instances;  // by the loader's key, which children share
std::map<void*, DeviceBelow> devices;
std::map<VkDeviceMemory, Memory> memories;
std::map<std::uint32_t, std::uint64_t> used;  // bytes of each heap
bool asked_for_portability = false;
std::uint64_t allocations = 0;
std::uint64_t submissions = 0;
std::map<VkCommandBuffer, std::uint64_t> groups;  // that each dispatches
// With a queue that only copies: what is for it, and what was handed to it and not begun.
constexpr std::uint32_t kTransferFamily = 1;  // lavapipe has one
std::set<VkCommandPool> transfer_pools;
std::set<VkCommandBuffer> transfer_commands;
std::map<VkSemaphore, VkCommandBuffer> held;
std::set<VkBuffer> kernel_buffers;
std::set<VkCommandBuffer> misplaced;  // copy what that queue should
std::set<VkFence> hung;               // of submissions that never end

template <typename Handle>
void* key(Handle handle) {
    return *reinterpret_cast<void**>(handle);
}

template <typename Handle>
InstanceBelow below_instance(Handle handle) {
    const std::lock_guard guard(lock);
    return instances.at(key(handle));
}

template <typename Handle>
DeviceBelow below_device(Handle handle) {
    const std::lock_guard guard(lock);
    return devices.at(key(handle));
}

#define BELOW_INSTANCE(handle, name) below_instance(handle).function<PFN_##name>(#name)
#define BELOW_DEVICE(handle, name) below_device(handle).function<PFN_##name>(#name)

/// The link of this layer in the chain that the loader made.
template <typename LinkInfo>
LinkInfo* link_of(const void* chain, VkStructureType type) {
    for (auto* info = const_cast<LinkInfo*>(static_cast<const LinkInfo*>(chain)); info != nullptr;
         info = const_cast<LinkInfo*>(static_cast<const LinkInfo*>(info->pNext))) {
        if (info->sType == type && info->function == VK_LAYER_LINK_INFO) {
            return info;
        }
    }
    return nullptr;
}

/// A structure in a chain of results.
template <typename Structure>
Structure* find(void* chain, VkStructureType type) {
    for (auto* next = static_cast<VkBaseOutStructure*>(chain); next != nullptr;
         next = next->pNext) {
        if (next->sType == type) {
            return reinterpret_cast<Structure*>(next);
        }
    }
    return nullptr;
}

// ---- instances and what they say of devices ----------------------------------------------------

VKAPI_ATTR VkResult VKAPI_CALL create_instance(const VkInstanceCreateInfo* info,
                                               const VkAllocationCallbacks* allocator,
                                               VkInstance* instance) {
    auto* link = link_of<VkLayerInstanceCreateInfo>(info->pNext,
                                                    VK_STRUCTURE_TYPE_LOADER_INSTANCE_CREATE_INFO);
    const auto get = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto create =
        reinterpret_cast<PFN_vkCreateInstance>(get(VK_NULL_HANDLE, "vkCreateInstance"));
    const VkResult result = create(info, allocator, instance);
    if (result == VK_SUCCESS) {
        const std::lock_guard guard(lock);
        instances[key(*instance)] = InstanceBelow(*instance, get);
        asked_for_portability =
            (info->flags & VK_INSTANCE_CREATE_ENUMERATE_PORTABILITY_BIT_KHR) != 0;
    }
    return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_instance(VkInstance instance,
                                            const VkAllocationCallbacks* allocator) {
    if (instance != VK_NULL_HANDLE) {
        const auto destroy = BELOW_INSTANCE(instance, vkDestroyInstance);
        {
            const std::lock_guard guard(lock);
            instances.erase(key(instance));
        }
        destroy(instance, allocator);
    }
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_devices(VkInstance instance, std::uint32_t* count,
                                                 VkPhysicalDevice* physical) {
    if (settings().portability && !asked_for_portability) {
        *count = 0;
        return VK_SUCCESS;
    }
    return BELOW_INSTANCE(instance, vkEnumeratePhysicalDevices)(instance, count, physical);
}

VKAPI_ATTR VkResult VKAPI_CALL enumerate_extensions(VkPhysicalDevice device, const char* layer,
                                                    std::uint32_t* count,
                                                    VkExtensionProperties* extensions) {
    const auto enumerate = BELOW_INSTANCE(device, vkEnumerateDeviceExtensionProperties);
    std::uint32_t below = 0;
    enumerate(device, layer, &below, nullptr);
    std::vector<VkExtensionProperties> all(below);
    enumerate(device, layer, &below, all.data());
    if (settings().subgroup > 0) {
        std::erase_if(all, [](const auto& extension) {
            return std::strcmp(extension.extensionName,
                               VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME) == 0;
        });
    }
    if (settings().portability) {
        auto& subset = all.emplace_back();
        std::snprintf(subset.extensionName, sizeof(subset.extensionName), "%s", kPortabilitySubset);
    }
    if (extensions != nullptr) {
        *count = std::min(*count, static_cast<std::uint32_t>(all.size()));
        std::copy_n(all.begin(), *count, extensions);
        return *count < all.size() ? VK_INCOMPLETE : VK_SUCCESS;
    }
    *count = static_cast<std::uint32_t>(all.size());
    return VK_SUCCESS;
}

void change(VkPhysicalDeviceProperties& properties) {
    const std::map<std::string, VkPhysicalDeviceType> kinds = {
        {"discrete", VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU},
        {"integrated", VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU},
        {"virtual", VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU}};
    const auto& s = settings();
    if (!s.kind.empty()) {
        properties.deviceType = kinds.at(s.kind);
        std::snprintf(properties.deviceName, sizeof(properties.deviceName), "other %s GPU",
                      s.kind.c_str());
    }
    if (s.groups > 0) {
        properties.limits.maxComputeWorkGroupCount[0] = static_cast<std::uint32_t>(s.groups);
        properties.limits.maxComputeWorkGroupCount[1] = static_cast<std::uint32_t>(s.groups);
    }
    if (s.storage_buffer > 0) {
        properties.limits.maxStorageBufferRange =
            static_cast<std::uint32_t>(s.storage_buffer * kMebibyte);
    }
}

VKAPI_ATTR void VKAPI_CALL get_properties(VkPhysicalDevice device,
                                          VkPhysicalDeviceProperties* properties) {
    BELOW_INSTANCE(device, vkGetPhysicalDeviceProperties)(device, properties);
    change(*properties);
}

VKAPI_ATTR void VKAPI_CALL get_properties2(VkPhysicalDevice device,
                                           VkPhysicalDeviceProperties2* properties) {
    BELOW_INSTANCE(device, vkGetPhysicalDeviceProperties2)(device, properties);
    change(properties->properties);
    const auto& s = settings();
    if (auto* v12 = find<VkPhysicalDeviceVulkan12Properties>(
            properties->pNext, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES)) {
        if (!s.kind.empty() && !s.software) {
            v12->driverID = VK_DRIVER_ID_AMD_PROPRIETARY;
        }
        if (s.untested) {
            v12->conformanceVersion = {};
        }
        if (s.no_rounding_modes) {
            v12->shaderRoundingModeRTEFloat32 = VK_FALSE;
            v12->shaderRoundingModeRTEFloat64 = VK_FALSE;
            v12->shaderSignedZeroInfNanPreserveFloat32 = VK_FALSE;
            v12->shaderSignedZeroInfNanPreserveFloat64 = VK_FALSE;
        }
    }
    if (auto* v11 = find<VkPhysicalDeviceVulkan11Properties>(
            properties->pNext, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_1_PROPERTIES)) {
        v11->subgroupSize =
            s.subgroup > 0 ? static_cast<std::uint32_t>(s.subgroup) : v11->subgroupSize;
    }
}

VKAPI_ATTR void VKAPI_CALL get_features(VkPhysicalDevice device,
                                        VkPhysicalDeviceFeatures* features) {
    BELOW_INSTANCE(device, vkGetPhysicalDeviceFeatures)(device, features);
    if (settings().no_float64) {
        features->shaderFloat64 = VK_FALSE;
    }
}

VKAPI_ATTR void VKAPI_CALL get_features2(VkPhysicalDevice device,
                                         VkPhysicalDeviceFeatures2* features) {
    BELOW_INSTANCE(device, vkGetPhysicalDeviceFeatures2)(device, features);
    if (settings().no_float64) {
        features->features.shaderFloat64 = VK_FALSE;
    }
}

/// As a card has them: memory of its own, a part of it that the host reaches, and the host's.
void change_heaps(VkPhysicalDeviceMemoryProperties& memory) {
    constexpr VkMemoryPropertyFlags kOwn = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT;
    constexpr VkMemoryPropertyFlags kHost =
        VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
    const auto& s = settings();
    if (s.heap == 0) {
        return;
    }
    const std::uint64_t all = memory.memoryHeaps[0].size;
    memory = {};
    const auto add_heap = [&](std::uint64_t bytes, VkMemoryHeapFlags flags) {
        memory.memoryHeaps[memory.memoryHeapCount] = {bytes, flags};
        return memory.memoryHeapCount++;
    };
    const auto add_type = [&](VkMemoryPropertyFlags flags, std::uint32_t heap) {
        memory.memoryTypes[memory.memoryTypeCount++] = {flags, heap};
    };
    const auto own = add_heap(s.heap * kMebibyte, VK_MEMORY_HEAP_DEVICE_LOCAL_BIT);
    add_type(kOwn, own);
    if (s.no_usable_memory) {
        return;
    }
    const auto host = add_heap(all, 0);
    add_type(kHost, host);
    if (s.bar > 0) {
        const auto reached =
            s.bar >= s.heap ? own : add_heap(s.bar * kMebibyte, VK_MEMORY_HEAP_DEVICE_LOCAL_BIT);
        add_type(kOwn | kHost, reached);
    }
    add_type(kHost | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, host);
}

void change(VkPhysicalDeviceMemoryProperties& memory) {
    change_heaps(memory);
    for (std::uint32_t i = 0; settings().non_coherent && i < memory.memoryTypeCount; ++i) {
        memory.memoryTypes[i].propertyFlags &=
            ~VkMemoryPropertyFlags{VK_MEMORY_PROPERTY_HOST_COHERENT_BIT};
    }
}

VKAPI_ATTR void VKAPI_CALL get_memory(VkPhysicalDevice device,
                                      VkPhysicalDeviceMemoryProperties* memory) {
    BELOW_INSTANCE(device, vkGetPhysicalDeviceMemoryProperties)(device, memory);
    change(*memory);
}

VKAPI_ATTR void VKAPI_CALL get_memory2(VkPhysicalDevice device,
                                       VkPhysicalDeviceMemoryProperties2* memory) {
    BELOW_INSTANCE(device, vkGetPhysicalDeviceMemoryProperties2)(device, memory);
    change(memory->memoryProperties);
    if (settings().heap == 0) {
        return;
    }
    if (auto* budget = find<VkPhysicalDeviceMemoryBudgetPropertiesEXT>(
            memory->pNext, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_MEMORY_BUDGET_PROPERTIES_EXT)) {
        const std::lock_guard guard(lock);
        for (std::uint32_t heap = 0; heap < memory->memoryProperties.memoryHeapCount; ++heap) {
            budget->heapBudget[heap] = memory->memoryProperties.memoryHeaps[heap].size;
            budget->heapUsage[heap] = used[heap];
        }
    }
}

VKAPI_ATTR void VKAPI_CALL get_families(VkPhysicalDevice device, std::uint32_t* count,
                                        VkQueueFamilyProperties* families) {
    const std::uint32_t room = *count;
    BELOW_INSTANCE(device, vkGetPhysicalDeviceQueueFamilyProperties)(device, count, families);
    if (settings().transfer_queue && families == nullptr) {
        ++*count;
    } else if (settings().transfer_queue && room > *count) {
        families[*count] = families[0];
        families[*count].queueFlags = VK_QUEUE_TRANSFER_BIT;
        ++*count;
    }
    for (std::uint32_t i = 0; families != nullptr && i < *count; ++i) {
        families[i].timestampValidBits = static_cast<std::uint32_t>(
            std::min<std::uint64_t>(families[i].timestampValidBits, settings().timestamp_bits));
    }
}

// ---- devices -----------------------------------------------------------------------------------

VKAPI_ATTR VkResult VKAPI_CALL create_device(VkPhysicalDevice physical,
                                             const VkDeviceCreateInfo* info,
                                             const VkAllocationCallbacks* allocator,
                                             VkDevice* device) {
    if (settings().no_float64 && info->pEnabledFeatures != nullptr &&
        info->pEnabledFeatures->shaderFloat64 == VK_TRUE) {
        return VK_ERROR_FEATURE_NOT_PRESENT;
    }
    auto* link =
        link_of<VkLayerDeviceCreateInfo>(info->pNext, VK_STRUCTURE_TYPE_LOADER_DEVICE_CREATE_INFO);
    const auto get_instance = link->u.pLayerInfo->pfnNextGetInstanceProcAddr;
    const auto get_device = link->u.pLayerInfo->pfnNextGetDeviceProcAddr;
    link->u.pLayerInfo = link->u.pLayerInfo->pNext;
    const auto create = reinterpret_cast<PFN_vkCreateDevice>(
        get_instance(below_instance(physical).handle, "vkCreateDevice"));
    VkDeviceCreateInfo real = *info;
    std::vector<const char*> extensions(
        info->ppEnabledExtensionNames, info->ppEnabledExtensionNames + info->enabledExtensionCount);
    if (settings().portability && std::erase_if(extensions, [](const char* name) {
                                      return std::strcmp(name, kPortabilitySubset) == 0;
                                  }) == 0) {
        return VK_ERROR_EXTENSION_NOT_PRESENT;  // a device that has it must be asked for it
    }
    real.enabledExtensionCount = static_cast<std::uint32_t>(extensions.size());
    real.ppEnabledExtensionNames = extensions.data();
    std::vector<VkDeviceQueueCreateInfo> queues(
        info->pQueueCreateInfos, info->pQueueCreateInfos + info->queueCreateInfoCount);
    if (settings().transfer_queue) {
        std::erase_if(queues, [](const auto& q) { return q.queueFamilyIndex == kTransferFamily; });
        real.pQueueCreateInfos = queues.data();
        real.queueCreateInfoCount = static_cast<std::uint32_t>(queues.size());
    }
    const VkResult result = create(physical, &real, allocator, device);
    if (result == VK_SUCCESS) {
        const std::lock_guard guard(lock);
        devices[key(*device)] = DeviceBelow(*device, get_device);
    }
    return result;
}

VKAPI_ATTR void VKAPI_CALL destroy_device(VkDevice device, const VkAllocationCallbacks* allocator) {
    if (device != VK_NULL_HANDLE) {
        const auto destroy = BELOW_DEVICE(device, vkDestroyDevice);
        {
            const std::lock_guard guard(lock);
            devices.erase(key(device));
        }
        destroy(device, allocator);
    }
}

/// Whether a module declares a capability (SPIR-V 3.31: instruction 17).
bool declares(std::span<const std::uint32_t> words, std::uint32_t capability) {
    for (std::size_t at = 5; at < words.size(); at += std::max<std::size_t>(1, words[at] >> 16U)) {
        if ((words[at] & 0xffffU) == 17 && at + 1 < words.size() && words[at + 1] == capability) {
            return true;
        }
    }
    return false;
}

VKAPI_ATTR VkResult VKAPI_CALL create_module(VkDevice device, const VkShaderModuleCreateInfo* info,
                                             const VkAllocationCallbacks* allocator,
                                             VkShaderModule* module) {
    constexpr std::uint32_t kFloat64 = 10;
    constexpr std::uint32_t kSignedZeroInfNanPreserve = 4466;
    constexpr std::uint32_t kRoundingModeRTE = 4467;
    const std::span words(info->pCode, info->codeSize / 4);
    const auto& s = settings();
    if ((s.no_float64 && declares(words, kFloat64)) ||
        (s.no_rounding_modes &&
         (declares(words, kRoundingModeRTE) || declares(words, kSignedZeroInfNanPreserve)))) {
        return VK_ERROR_INVALID_SHADER_NV;
    }
    return BELOW_DEVICE(device, vkCreateShaderModule)(device, info, allocator, module);
}

bool is_transfer(std::uint32_t family) {
    return settings().transfer_queue && family == kTransferFamily;
}

VKAPI_ATTR void VKAPI_CALL get_queue(VkDevice device, std::uint32_t family, std::uint32_t index,
                                     VkQueue* queue) {
    BELOW_DEVICE(device, vkGetDeviceQueue)(device, is_transfer(family) ? 0 : family, index, queue);
}

VKAPI_ATTR VkResult VKAPI_CALL create_pool(VkDevice device, const VkCommandPoolCreateInfo* info,
                                           const VkAllocationCallbacks* allocator,
                                           VkCommandPool* pool) {
    VkCommandPoolCreateInfo real = *info;
    real.queueFamilyIndex = is_transfer(info->queueFamilyIndex) ? 0 : info->queueFamilyIndex;
    const VkResult result =
        BELOW_DEVICE(device, vkCreateCommandPool)(device, &real, allocator, pool);
    const std::lock_guard guard(lock);
    if (result == VK_SUCCESS && is_transfer(info->queueFamilyIndex)) {
        transfer_pools.insert(*pool);
    } else if (result == VK_SUCCESS) {
        transfer_pools.erase(*pool);
    }
    return result;
}

VKAPI_ATTR VkResult VKAPI_CALL allocate_commands(VkDevice device,
                                                 const VkCommandBufferAllocateInfo* info,
                                                 VkCommandBuffer* commands) {
    const VkResult result = BELOW_DEVICE(device, vkAllocateCommandBuffers)(device, info, commands);
    const std::lock_guard guard(lock);
    for (std::uint32_t i = 0; result == VK_SUCCESS && i < info->commandBufferCount; ++i) {
        if (transfer_pools.contains(info->commandPool)) {
            transfer_commands.insert(commands[i]);
        } else {
            transfer_commands.erase(commands[i]);  // of a pool that is gone
        }
    }
    return result;
}

VKAPI_ATTR VkResult VKAPI_CALL create_buffer(VkDevice device, const VkBufferCreateInfo* info,
                                             const VkAllocationCallbacks* allocator,
                                             VkBuffer* buffer) {
    VkBufferCreateInfo real = *info;
    if (settings().transfer_queue) {
        real.sharingMode = VK_SHARING_MODE_EXCLUSIVE;
    }
    const VkResult result = BELOW_DEVICE(device, vkCreateBuffer)(device, &real, allocator, buffer);
    if (result == VK_SUCCESS) {
        const std::lock_guard guard(lock);
        kernel_buffers.erase(*buffer);
        if ((info->usage & VK_BUFFER_USAGE_STORAGE_BUFFER_BIT) != 0) {
            kernel_buffers.insert(*buffer);
        }
    }
    return result;
}

VKAPI_ATTR void VKAPI_CALL get_requirements(VkDevice device, VkBuffer buffer,
                                            VkMemoryRequirements* requirements) {
    BELOW_DEVICE(device, vkGetBufferMemoryRequirements)(device, buffer, requirements);
    if (settings().heap > 0) {
        requirements->memoryTypeBits = 0xf;  // as many as change() makes, or more
    }
}

VKAPI_ATTR VkResult VKAPI_CALL allocate(VkDevice device, const VkMemoryAllocateInfo* info,
                                        const VkAllocationCallbacks* allocator,
                                        VkDeviceMemory* memory) {
    const auto& s = settings();
    Memory taken = {.heap = 0, .bytes = info->allocationSize, .can_be_mapped = true};
    VkMemoryAllocateInfo real = *info;
    {
        const std::lock_guard guard(lock);
        ++allocations;
        if (s.fail_allocation > 0 && allocations >= s.fail_allocation) {
            return VK_ERROR_OUT_OF_DEVICE_MEMORY;
        }
        if (s.heap > 0) {
            VkPhysicalDeviceMemoryProperties other = {};
            change(other);
            const auto& type = other.memoryTypes[info->memoryTypeIndex];
            taken.heap = type.heapIndex;
            taken.can_be_mapped = (type.propertyFlags & VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT) != 0;
            const auto& heap = other.memoryHeaps[taken.heap];
            if ((heap.flags & VK_MEMORY_HEAP_DEVICE_LOCAL_BIT) != 0 &&
                used[taken.heap] + taken.bytes > heap.size) {
                return VK_ERROR_OUT_OF_DEVICE_MEMORY;
            }
            real.memoryTypeIndex = 0;  // the one of lavapipe
        }
    }
    const VkResult result =
        BELOW_DEVICE(device, vkAllocateMemory)(device, &real, allocator, memory);
    if (result == VK_SUCCESS) {
        const std::lock_guard guard(lock);
        used[taken.heap] += taken.bytes;
        memories[*memory] = taken;
    }
    return result;
}

VKAPI_ATTR void VKAPI_CALL free_memory(VkDevice device, VkDeviceMemory memory,
                                       const VkAllocationCallbacks* allocator) {
    {
        const std::lock_guard guard(lock);
        if (const auto found = memories.find(memory); found != memories.end()) {
            used[found->second.heap] -= found->second.bytes;
            memories.erase(found);
        }
    }
    BELOW_DEVICE(device, vkFreeMemory)(device, memory, allocator);
}

VKAPI_ATTR VkResult VKAPI_CALL map_memory(VkDevice device, VkDeviceMemory memory,
                                          VkDeviceSize offset, VkDeviceSize size,
                                          VkMemoryMapFlags flags, void** data) {
    {
        const std::lock_guard guard(lock);
        if (!memories.at(memory).can_be_mapped) {
            return VK_ERROR_MEMORY_MAP_FAILED;
        }
    }
    const VkResult result =
        BELOW_DEVICE(device, vkMapMemory)(device, memory, offset, size, flags, data);
    if (result == VK_SUCCESS && settings().non_coherent) {
        const std::lock_guard guard(lock);
        auto& mapped = memories.at(memory);
        mapped.shadow.assign(mapped.bytes, kNeverWritten);
        mapped.real = static_cast<char*>(*data) - offset;
        *data = mapped.shadow.data() + offset;
    }
    return result;
}

/// Copies between what the host maps and the real memory.
void copy_ranges(std::span<const VkMappedMemoryRange> ranges, bool to_real) {
    const std::lock_guard guard(lock);
    for (const auto& range : ranges) {
        auto& mapped = memories.at(range.memory);
        if (mapped.real != nullptr) {
            const auto bytes = std::min(range.size, mapped.bytes - range.offset);
            char* const shadow = mapped.shadow.data() + range.offset;
            char* const real = mapped.real + range.offset;
            std::memcpy(to_real ? real : shadow, to_real ? shadow : real, bytes);
        }
    }
}

VKAPI_ATTR VkResult VKAPI_CALL flush_ranges(VkDevice device, std::uint32_t count,
                                            const VkMappedMemoryRange* ranges) {
    copy_ranges({ranges, count}, /*to_real=*/true);
    return BELOW_DEVICE(device, vkFlushMappedMemoryRanges)(device, count, ranges);
}

VKAPI_ATTR VkResult VKAPI_CALL invalidate_ranges(VkDevice device, std::uint32_t count,
                                                 const VkMappedMemoryRange* ranges) {
    const VkResult result =
        BELOW_DEVICE(device, vkInvalidateMappedMemoryRanges)(device, count, ranges);
    copy_ranges({ranges, count}, /*to_real=*/false);
    return result;
}

VKAPI_ATTR VkResult VKAPI_CALL begin_commands(VkCommandBuffer commands,
                                              const VkCommandBufferBeginInfo* info) {
    {
        const std::lock_guard guard(lock);
        groups[commands] = 0;
        misplaced.erase(commands);
    }
    return BELOW_DEVICE(commands, vkBeginCommandBuffer)(commands, info);
}

void count_groups(VkCommandBuffer commands, std::uint64_t x, std::uint64_t y, std::uint64_t z) {
    const std::lock_guard guard(lock);
    groups[commands] += x * y * z;
}

VKAPI_ATTR void VKAPI_CALL dispatch(VkCommandBuffer commands, std::uint32_t x, std::uint32_t y,
                                    std::uint32_t z) {
    count_groups(commands, x, y, z);
    BELOW_DEVICE(commands, vkCmdDispatch)(commands, x, y, z);
}

VKAPI_ATTR void VKAPI_CALL dispatch_base(VkCommandBuffer commands, std::uint32_t first_x,
                                         std::uint32_t first_y, std::uint32_t first_z,
                                         std::uint32_t x, std::uint32_t y, std::uint32_t z) {
    count_groups(commands, x, y, z);
    const std::uint32_t run = settings().wrong == x && x > 1 ? x - 1 : x;
    BELOW_DEVICE(commands, vkCmdDispatchBase)(commands, first_x, first_y, first_z, run, y, z);
}

VKAPI_ATTR void VKAPI_CALL copy_buffer(VkCommandBuffer commands, VkBuffer from, VkBuffer to,
                                       std::uint32_t count, const VkBufferCopy* regions) {
    {
        const std::lock_guard guard(lock);
        if (settings().transfer_queue && kernel_buffers.contains(to) &&
            !transfer_commands.contains(commands)) {
            misplaced.insert(commands);
        }
    }
    BELOW_DEVICE(commands, vkCmdCopyBuffer)(commands, from, to, count, regions);
}

/// Whether a submission would take a watchdog too long.
bool is_too_much(std::span<const VkSubmitInfo> infos) {
    std::uint64_t all = 0;
    for (const auto& info : infos) {
        for (std::uint32_t i = 0; i < info.commandBufferCount; ++i) {
            all += groups[info.pCommandBuffers[i]];
        }
    }
    return settings().groups_at_once > 0 && all > settings().groups_at_once;
}

/// Queues run side by side: what is handed to the one that only copies begins as late as it may,
/// when a submission waits for it. Copies to kernels must not be anywhere else.
VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos,
                                      VkFence fence) {
    std::vector<std::pair<VkSemaphore, VkCommandBuffer>> before;
    {
        const std::lock_guard guard(lock);
        if (transfer_commands.contains(infos[0].pCommandBuffers[0])) {
            held[infos[0].pSignalSemaphores[0]] = infos[0].pCommandBuffers[0];
            return VK_SUCCESS;
        }
        if (misplaced.contains(infos[0].pCommandBuffers[0])) {
            return VK_ERROR_DEVICE_LOST;
        }
        for (std::uint32_t i = 0; i < infos[0].waitSemaphoreCount; ++i) {
            if (const auto node = held.extract(infos[0].pWaitSemaphores[i])) {
                before.emplace_back(node.key(), node.mapped());
            }
        }
        ++submissions;
        if ((settings().lose_at > 0 && submissions >= settings().lose_at) ||
            is_too_much({infos, count})) {
            return VK_ERROR_DEVICE_LOST;
        }
        if (settings().hang_at > 0 && submissions >= settings().hang_at) {
            hung.insert(fence);
            return VK_SUCCESS;
        }
    }
    const auto real_submit = BELOW_DEVICE(queue, vkQueueSubmit);
    for (const auto& [semaphore, commands] : before) {
        VkSubmitInfo info = {};
        info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
        info.commandBufferCount = 1;
        info.pCommandBuffers = &commands;
        info.signalSemaphoreCount = 1;
        info.pSignalSemaphores = &semaphore;
        const VkResult result = real_submit(queue, 1, &info, VK_NULL_HANDLE);
        if (result != VK_SUCCESS) {
            return result;
        }
    }
    return real_submit(queue, count, infos, fence);
}

/// For what never ends a wait takes as long as was asked, but no more than a tenth of a second, so
/// that a test need not be patient.
VKAPI_ATTR VkResult VKAPI_CALL wait_for_fences(VkDevice device, std::uint32_t count,
                                               const VkFence* fences, VkBool32 all,
                                               std::uint64_t timeout) {
    bool ends = true;
    {
        const std::lock_guard guard(lock);
        ends = std::none_of(fences, fences + count, [](VkFence f) { return hung.contains(f); });
    }
    if (ends) {
        return BELOW_DEVICE(device, vkWaitForFences)(device, count, fences, all, timeout);
    }
    const timespec span = {0, static_cast<long>(std::min<std::uint64_t>(timeout, 100'000'000))};
    ::nanosleep(&span, nullptr);
    return VK_TIMEOUT;
}

VKAPI_ATTR VkResult VKAPI_CALL get_results(VkDevice device, VkQueryPool pool, std::uint32_t first,
                                           std::uint32_t count, std::size_t bytes, void* data,
                                           VkDeviceSize stride, VkQueryResultFlags flags) {
    const VkResult result = BELOW_DEVICE(device, vkGetQueryPoolResults)(device, pool, first, count,
                                                                        bytes, data, stride, flags);
    const auto bits = settings().timestamp_bits;
    if (result == VK_SUCCESS && bits > 0 && bits < 64) {
        for (std::uint32_t i = 0; i < count; ++i) {  // the program asks for 64 bits each
            std::uint64_t ticks = 0;
            char* const place = static_cast<char*>(data) + i * stride;
            std::memcpy(&ticks, place, sizeof(ticks));
            ticks &= (std::uint64_t{1} << bits) - 1;
            std::memcpy(place, &ticks, sizeof(ticks));
        }
    }
    return result;
}

// ---- how the loader finds all that
// ---------------------------------------------------------------

VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_device_function(VkDevice device, const char* name);
VKAPI_ATTR PFN_vkVoidFunction VKAPI_CALL get_instance_function(VkInstance instance,
                                                               const char* name);

template <typename Function>
PFN_vkVoidFunction as_function(Function* function) {
    return reinterpret_cast<PFN_vkVoidFunction>(function);
}

const std::map<std::string_view, PFN_vkVoidFunction> own_functions = {
    {"vkGetInstanceProcAddr", as_function(get_instance_function)},
    {"vkGetDeviceProcAddr", as_function(get_device_function)},
    {"vkCreateInstance", as_function(create_instance)},
    {"vkDestroyInstance", as_function(destroy_instance)},
    {"vkEnumeratePhysicalDevices", as_function(enumerate_devices)},
    {"vkEnumerateDeviceExtensionProperties", as_function(enumerate_extensions)},
    {"vkGetPhysicalDeviceProperties", as_function(get_properties)},
    {"vkGetPhysicalDeviceProperties2", as_function(get_properties2)},
    {"vkGetPhysicalDeviceFeatures", as_function(get_features)},
    {"vkGetPhysicalDeviceFeatures2", as_function(get_features2)},
    {"vkGetPhysicalDeviceMemoryProperties", as_function(get_memory)},
    {"vkGetPhysicalDeviceMemoryProperties2", as_function(get_memory2)},
    {"vkGetPhysicalDeviceQueueFamilyProperties", as_function(get_families)},
    {"vkCreateDevice", as_function(create_device)},
    {"vkDestroyDevice", as_function(destroy_device)},
    {"vkCreateShaderModule", as_function(create_module)},
    {"vkGetDeviceQueue", as_function(get_queue)},
    {"vkCreateCommandPool", as_function(create_pool)},
    {"vkAllocateCommandBuffers", as_function(allocate_commands)},
    {"vkCreateBuffer", as_function(create_buffer)},
    {"vkCmdCopyBuffer", as_function(copy_buffer)},
    {"vkGetBufferMemoryRequirements", as_function(get_requirements)},
    {"vkAllocateMemory", as_function(allocate)},
    {"vkFreeMemory", as_function(free_memory)},
    {"vkMapMemory", as_function(map_memory)},
    {"vkFlushMappedMemoryRanges", as_function(flush_ranges)},
    {"vkInvalidateMappedMemoryRanges", as_function(invalidate_ranges)},
    {"vkBeginCommandBuffer", as_function(begin_commands)},
    {"vkCmdDispatch", as_function(dispatch)},
    {"vkCmdDispatchBase", as_function(dispatch_base)},
    {"vkQueueSubmit", as_function(submit)},
    {"vkWaitForFences", as_function(wait_for_fences)},
    {"vkGetQueryPoolResults", as_function(get_results)}};

PFN_vkVoidFunction own_function(std::string_view name) {
    const auto found = own_functions.find(name);
    return found == own_functions.end() ? nullptr : found->second;
}

std::span<const std::string_view> own_names() {
    static const std::vector<std::string_view> names = [] {
        std::vector<std::string_view> all;
        for (const auto& [name, function] : own_functions) {
            all.push_back(name);
        }
        return all;
    }();
    return names;
}

PFN_vkVoidFunction get_device_function(VkDevice device, const char* name) {
    const auto own = own_function(name);
    return own != nullptr ? own : below_device(device).get(device, name);
}

PFN_vkVoidFunction get_instance_function(VkInstance instance, const char* name) {
    const auto own = own_function(name);
    if (own != nullptr) {
        return own;
    }
    return instance == VK_NULL_HANDLE ? nullptr : below_instance(instance).get(instance, name);
}

}  // namespace

extern "C" VK_LAYER_EXPORT VKAPI_ATTR VkResult VKAPI_CALL
vkNegotiateLoaderLayerInterfaceVersion(VkNegotiateLayerInterface* interface) {
    interface->loaderLayerInterfaceVersion = 2;
    interface->pfnGetInstanceProcAddr = get_instance_function;
    interface->pfnGetDeviceProcAddr = get_device_function;
    interface->pfnGetPhysicalDeviceProcAddr = nullptr;
    return VK_SUCCESS;
}
