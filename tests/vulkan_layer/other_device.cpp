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
#include <map>
#include <mutex>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

namespace {

constexpr const char* kName = "VK_LAYER_MERL_SCAN_other_device";
constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20U;

struct Settings {
    std::string kind;                   // kind=discrete, integrated or virtual
    std::uint64_t heap = 0;             // heap=MIB of memory of its own
    std::uint64_t bar = 0;              // bar=MIB of that can be mapped; needs heap
    std::uint64_t fail_allocation = 0;  // fail-allocation=N: the Nth fails, and all after it
    std::uint64_t lose_at = 0;          // lose-at=N: the Nth submission finds the device lost
    std::uint64_t timestamp_bits = 64;  // timestamp-bits=N
    std::uint64_t groups = 0;           // groups=N: the most workgroups along x and y
    std::uint64_t storage_buffer = 0;   // storage-buffer=MIB: the largest
    bool no_usable_memory = false;      // no-usable-memory: none that can be mapped
    bool no_float64 = false;            // no-float64
    bool no_rounding_modes = false;     // no-rounding-modes: nor that NaN is kept
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
        {"timestamp-bits", &Settings::timestamp_bits},
        {"groups", &Settings::groups},
        {"storage-buffer", &Settings::storage_buffer}};
    const std::map<std::string, bool Settings::*> switches = {
        {"no-usable-memory", &Settings::no_usable_memory},
        {"no-float64", &Settings::no_float64},
        {"no-rounding-modes", &Settings::no_rounding_modes}};
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
};

std::mutex lock;
std::map<void*, InstanceBelow> instances;  // by the loader's key, which children share
std::map<void*, DeviceBelow> devices;
std::map<VkDeviceMemory, Memory> memories;
std::map<std::uint32_t, std::uint64_t> used;  // bytes of each heap
std::uint64_t allocations = 0;
std::uint64_t submissions = 0;

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
    auto* floats = find<VkPhysicalDeviceVulkan12Properties>(
        properties->pNext, VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_VULKAN_1_2_PROPERTIES);
    if (settings().no_rounding_modes && floats != nullptr) {
        floats->shaderRoundingModeRTEFloat32 = VK_FALSE;
        floats->shaderRoundingModeRTEFloat64 = VK_FALSE;
        floats->shaderSignedZeroInfNanPreserveFloat32 = VK_FALSE;
        floats->shaderSignedZeroInfNanPreserveFloat64 = VK_FALSE;
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
void change(VkPhysicalDeviceMemoryProperties& memory) {
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
    BELOW_INSTANCE(device, vkGetPhysicalDeviceQueueFamilyProperties)(device, count, families);
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
    const VkResult result = create(physical, info, allocator, device);
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
    return BELOW_DEVICE(device, vkMapMemory)(device, memory, offset, size, flags, data);
}

VKAPI_ATTR VkResult VKAPI_CALL submit(VkQueue queue, std::uint32_t count, const VkSubmitInfo* infos,
                                      VkFence fence) {
    {
        const std::lock_guard guard(lock);
        ++submissions;
        if (settings().lose_at > 0 && submissions >= settings().lose_at) {
            return VK_ERROR_DEVICE_LOST;
        }
    }
    return BELOW_DEVICE(queue, vkQueueSubmit)(queue, count, infos, fence);
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
    {"vkGetBufferMemoryRequirements", as_function(get_requirements)},
    {"vkAllocateMemory", as_function(allocate)},
    {"vkFreeMemory", as_function(free_memory)},
    {"vkMapMemory", as_function(map_memory)},
    {"vkQueueSubmit", as_function(submit)},
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
