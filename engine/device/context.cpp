#include "engine/device/context.h"

#include <dlfcn.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>
#include <tuple>

#include "engine/base/error.h"
#include "engine/device/buffer_handles.h"
#include "engine/device/handles.h"

namespace merl::device {
namespace {

constexpr std::uint32_t kVulkanVersion = VK_API_VERSION_1_2;
constexpr const char* kValidationLayer = "VK_LAYER_KHRONOS_validation";
constexpr const char* kSubgroupSizeControl = VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME;
constexpr const char* kMemoryBudget = VK_EXT_MEMORY_BUDGET_EXTENSION_NAME;

std::string version_text(std::uint32_t version) {
    return fmt::format("{}.{}.{}", VK_API_VERSION_MAJOR(version), VK_API_VERSION_MINOR(version),
                       VK_API_VERSION_PATCH(version));
}

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

/// Lower is better: the order in which devices are preferred.
int preference(const DeviceInfo& info) {
    constexpr std::array<std::string_view, 4> order = {"discrete GPU", "integrated GPU",
                                                       "virtual GPU", "CPU"};
    return static_cast<int>(std::find(order.begin(), order.end(), info.kind) - order.begin());
}

std::optional<std::uint32_t> compute_queue_family(const vk::raii::PhysicalDevice& physical) {
    const auto families = physical.getQueueFamilyProperties();
    for (std::uint32_t i = 0; i < families.size(); ++i) {
        if (families[i].queueFlags & vk::QueueFlagBits::eCompute) {
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

DeviceInfo describe(const vk::raii::PhysicalDevice& physical, std::uint32_t index) {
    DeviceInfo info;
    info.index = index;
    const auto basic = physical.getProperties();
    info.name = basic.deviceName.data();
    info.kind = kind_text(basic.deviceType);
    info.limits.is_host = basic.deviceType == vk::PhysicalDeviceType::eCpu;
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
    info.limits.storage_buffer_bytes = limits.maxStorageBufferRange;
    info.limits.texel_buffer_texels = limits.maxTexelBufferElements;
    info.limits.allocation_bytes = v11.maxMemoryAllocationSize;
    info.limits.groups_x = limits.maxComputeWorkGroupCount[0];
    info.limits.groups_y = limits.maxComputeWorkGroupCount[1];
    info.limits.subgroup_size = v11.subgroupSize;
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
    } else if (!physical.getFeatures().shaderFloat64) {
        info.refusal = "it has no float64 in shaders";
    }
    return info;
}

vk::raii::Instance make_instance(const vk::raii::Context& loader, const std::string& validate) {
    if (loader.enumerateInstanceVersion() < kVulkanVersion) {
        throw Error(Fault::device,
                    fmt::format("the Vulkan loader offers version {}, and 1.2 is needed",
                                version_text(loader.enumerateInstanceVersion())));
    }
    vk::ApplicationInfo application("merl-scan", 1, "merl-scan", 1, kVulkanVersion);
    std::vector<const char*> layers;
    std::vector<const char*> extensions;
    std::vector<vk::ValidationFeatureEnableEXT> features;
    if (!validate.empty()) {
        const auto available = loader.enumerateInstanceLayerProperties();
        if (std::none_of(available.begin(), available.end(), [](const auto& layer) {
                return std::strcmp(layer.layerName, kValidationLayer) == 0;
            })) {
            throw Error(Fault::device,
                        fmt::format("MERL_SCAN_VALIDATE is set, but {} is not installed "
                                    "(the Khronos validation layers)",
                                    kValidationLayer));
        }
        layers.push_back(kValidationLayer);
        extensions.push_back(VK_EXT_DEBUG_UTILS_EXTENSION_NAME);
        if (validate == "sync") {
            features.push_back(vk::ValidationFeatureEnableEXT::eSynchronizationValidation);
        } else if (validate == "gpu") {
            features.push_back(vk::ValidationFeatureEnableEXT::eGpuAssisted);
            features.push_back(vk::ValidationFeatureEnableEXT::eGpuAssistedReserveBindingSlot);
        } else if (validate != "core") {
            throw Error(Fault::usage,
                        fmt::format("MERL_SCAN_VALIDATE is \"{}\"; expected core, sync or "
                                    "gpu",
                                    validate));
        }
    }
    vk::ValidationFeaturesEXT validation(features);
    vk::InstanceCreateInfo create({}, &application, layers, extensions);
    if (!features.empty()) {
        create.pNext = &validation;
    }
    try {
        return {loader, create};
    } catch (const vk::IncompatibleDriverError&) {
        return nullptr;  // what the loader says when it finds no driver at all
    }
}

std::string validation_mode() {
    const char* value = std::getenv("MERL_SCAN_VALIDATE");
    return value ? value : "";
}

/// The limits of this process that a driver may not fit into, as the rest of a sentence.
std::string lack_of_room() {
    std::string text;
    for (const auto& [resource, what, option] :
         {std::tuple(RLIMIT_AS, "address space", "-v"), {RLIMIT_DATA, "data", "-d"}}) {
        rlimit limit = {};
        if (::getrlimit(resource, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY) {
            text += fmt::format(
                "; the {} of this process is limited to {} MiB (ulimit {}), and a driver may need "
                "several hundred: raise it",
                what, limit.rlim_cur >> 20U, option);
        }
    }
    return text;
}

/// The variables with which a user, or a file that was sourced once, chooses drivers.
std::string hiding_variables() {
    std::string text;
    for (const char* name : {"VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_LOADER_DRIVERS_SELECT",
                             "VK_LOADER_DRIVERS_DISABLE"}) {
        if (const char* value = std::getenv(name); value != nullptr) {
            text += fmt::format("; {} is \"{}\", which may hide it: unset it", name, value);
        }
    }
    // The loader looks nowhere else for what packages install.
    const char* directories = std::getenv("XDG_DATA_DIRS");
    if (directories != nullptr && std::strstr(directories, "/usr/share") == nullptr &&
        ::access("/usr/share/vulkan/icd.d", F_OK) == 0) {
        text += fmt::format("; XDG_DATA_DIRS is \"{}\", without /usr/share: add it", directories);
    }
    return text;
}

/// The library that a driver's manifest names; empty if it names none.
std::string library_of(const std::filesystem::path& manifest) {
    std::ifstream file(manifest);
    const auto json = nlohmann::json::parse(file, nullptr, false);
    const nlohmann::json::json_pointer place("/ICD/library_path");
    return json.contains(place) && json[place].is_string() ? json[place].get<std::string>() : "";
}

/// The drivers that are installed where packages put them, and what keeps each from loading.
std::string installed_drivers() {
    std::string text;
    for (const char* folder : {"/usr/share/vulkan/icd.d", "/usr/local/share/vulkan/icd.d",
                               "/etc/vulkan/icd.d", "/usr/local/etc/vulkan/icd.d"}) {
        std::error_code none;
        for (std::filesystem::directory_iterator i(folder, none), end; !none && i != end;
             i.increment(none)) {
            if (i->path().extension() != ".json") {
                continue;
            }
            auto library = library_of(i->path());
            if (library.find('/') != std::string::npos) {  // else the system looks for it
                library = (i->path().parent_path() / library).string();
            }
            void* const loaded = ::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL);
            text += fmt::format("{}{}{}", text.empty() ? "" : ", ", i->path().string(),
                                loaded != nullptr
                                    ? ""
                                    : fmt::format(" (its library {} cannot be loaded)", library));
            if (loaded != nullptr) {
                ::dlclose(loaded);
            }
        }
    }
    return text;
}

/// Why there is no device at all.
NoDriverError why_no_device() {
    const std::string installed = installed_drivers();
    const std::string reasons = hiding_variables() + lack_of_room();
    if (installed.empty()) {
        return {"no Vulkan driver is installed" + reasons, !reasons.empty()};
    }
    return {fmt::format("no Vulkan driver found, although there is {}{}", installed, reasons),
            true};
}

/// The loader, or an Error that says how to get it.
vk::raii::Context make_loader() {
    try {
        return {};
    } catch (const std::runtime_error&) {
        const std::string room = lack_of_room();
        throw NoDriverError("the Vulkan loader (libvulkan.so.1) cannot be loaded" + room,
                            !room.empty());
    }
}

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data,
                                            void* user) {
    auto* handles = static_cast<Context::Handles*>(user);
    const std::lock_guard lock(handles->message_lock);
    handles->messages.emplace_back(data->pMessage);
    return VK_FALSE;
}

std::vector<DeviceInfo> describe_all(const std::vector<vk::raii::PhysicalDevice>& physical) {
    std::vector<DeviceInfo> devices;
    for (std::uint32_t i = 0; i < physical.size(); ++i) {
        devices.push_back(describe(physical[i], i));
    }
    return devices;
}

std::vector<vk::raii::PhysicalDevice> enumerate(const vk::raii::Instance& instance) {
    if (!*instance) {
        return {};
    }
    try {
        return vk::raii::PhysicalDevices(instance);
    } catch (const vk::InitializationFailedError&) {
        return {};
    }
}

}  // namespace

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

std::vector<DeviceInfo> list_devices() {
    const auto loader = make_loader();
    const auto instance = guarded("vkCreateInstance", [&] { return make_instance(loader, ""); });
    auto devices = describe_all(enumerate(instance));
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

Context::Context(const ContextOptions& options) {
    handles_ = std::make_unique<Handles>(make_loader());
    auto& h = *handles_;
    const std::string validate = validation_mode();
    h.instance = guarded("vkCreateInstance", [&] { return make_instance(h.loader, validate); });
    if (!validate.empty() && *h.instance) {
        using Severity = vk::DebugUtilsMessageSeverityFlagBitsEXT;
        using Type = vk::DebugUtilsMessageTypeFlagBitsEXT;
        h.messenger = {h.instance,
                       {{},
                        Severity::eWarning | Severity::eError,
                        Type::eValidation | Type::ePerformance,
                        keep_message,
                        &h}};
    }
    auto physical = enumerate(h.instance);
    const auto devices = describe_all(physical);
    const std::size_t chosen = choose_device(devices, options.device);
    h.physical = std::move(physical[chosen]);
    h.info = devices[chosen];
    h.info.limits.stages_uploads |= options.force_staging;
    h.info.limits.stages_downloads |= options.force_staging;
    h.queue_family = *compute_queue_family(h.physical);
    h.memory = h.physical.getMemoryProperties();

    const auto family = h.physical.getQueueFamilyProperties()[h.queue_family];
    if (family.timestampValidBits > 0) {
        h.timestamp_seconds =
            static_cast<double>(h.physical.getProperties().limits.timestampPeriod) * 1e-9;
        h.timestamp_mask = ~std::uint64_t{0} >> (64 - family.timestampValidBits);
    }

    std::vector<const char*> extensions;
    vk::PhysicalDeviceSubgroupSizeControlFeaturesEXT size_control(true, true);
    vk::DeviceCreateInfo create;
    if (has_extension(h.physical, kSubgroupSizeControl)) {
        const auto offered = h.physical
                                 .getFeatures2<vk::PhysicalDeviceFeatures2,
                                               vk::PhysicalDeviceSubgroupSizeControlFeatures>()
                                 .get<vk::PhysicalDeviceSubgroupSizeControlFeatures>();
        const auto stages = h.physical
                                .getProperties2<vk::PhysicalDeviceProperties2,
                                                vk::PhysicalDeviceSubgroupSizeControlProperties>()
                                .get<vk::PhysicalDeviceSubgroupSizeControlProperties>()
                                .requiredSubgroupSizeStages;
        if (offered.subgroupSizeControl && offered.computeFullSubgroups &&
            (stages & vk::ShaderStageFlagBits::eCompute)) {
            extensions.push_back(kSubgroupSizeControl);
            h.subgroup_size_control = true;
            create.pNext = &size_control;
        }
    }
    const float priority = 1.0F;
    vk::DeviceQueueCreateInfo queue({}, h.queue_family, 1, &priority);
    create.setQueueCreateInfos(queue);
    vk::PhysicalDeviceFeatures features;
    features.shaderFloat64 = true;
    create.pEnabledFeatures = &features;
    create.setPEnabledExtensionNames(extensions);
    guarded("vkCreateDevice (which needs memory and threads)", [&] {
        h.device = {h.physical, create};
        h.queue = {h.device, h.queue_family, 0};
        h.pool = {h.device, {vk::CommandPoolCreateFlagBits::eResetCommandBuffer, h.queue_family}};
        h.cache = {h.device, vk::PipelineCacheCreateInfo()};
    });
}

Context::~Context() = default;

const DeviceInfo& Context::info() const {
    return handles_->info;
}
std::uint64_t Context::allocated_bytes() const {
    return handles_->allocated;
}
std::uint64_t Context::peak_allocated_bytes() const {
    return handles_->peak_allocated;
}

void Context::check_validation() {
    const std::lock_guard lock(handles_->message_lock);
    if (handles_->messages.empty()) {
        return;
    }
    std::string all = "the Vulkan validation layer complains:";
    for (const auto& message : handles_->messages) {
        all += "\n  " + message;
    }
    handles_->messages.clear();
    throw std::logic_error(all);
}

}  // namespace merl::device
