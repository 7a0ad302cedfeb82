#include "engine/device/context.h"

#include <fmt/format.h>

#include <exception>
#include <optional>
#include <string_view>

#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/kept_file.h"
#include "engine/device/descriptions.h"
#include "engine/device/handles.h"
#include "engine/device/instance.h"
#include "engine/device/subgroup_check.h"

namespace merl::device {
namespace {

/// Every metric file that was ever edited adds some.
constexpr std::uint64_t kMostPipelineBytes = std::uint64_t{64} << 20U;

constexpr const char* kPortabilitySubset = "VK_KHR_portability_subset";  // its header is a beta

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data,
                                            void* user) {
    auto* handles = static_cast<Context::Handles*>(user);
    const std::lock_guard lock(handles->message_lock);
    handles->messages.emplace_back(data->pMessage);
    return VK_FALSE;
}

/// The file for this device, whose driver's next version takes the place of this one.
std::filesystem::path pipelines_file(const std::filesystem::path& directory,
                                     const vk::PhysicalDeviceProperties& device) {
    return directory / fmt::format("pipelines-{:04x}-{:04x}.bin", device.vendorID, device.deviceID);
}

/// The version of the driver, whose pipelines no other can use: what its file begins with.
std::string pipelines_version(const vk::PhysicalDeviceProperties& device) {
    const std::string uuid(device.pipelineCacheUUID.begin(), device.pipelineCacheUUID.end());
    return hash_of(
        fmt::format("{} {} {} {}", uuid, device.vendorID, device.deviceID, device.driverVersion));
}

/// With what was kept in the directory, unless that is empty. Drivers need not survive bytes that
/// they have not written, so they get no others.
void open_pipelines(Context::Handles& h, const std::filesystem::path& directory) {
    std::string bytes;
    if (!directory.empty()) {
        const auto device = h.physical.getProperties();
        h.pipelines_file = pipelines_file(directory, device);
        h.pipelines_version = pipelines_version(device);
        const auto kept = read_kept(h.pipelines_file, kMostPipelineBytes);
        if (kept && kept->starts_with(h.pipelines_version)) {
            bytes = kept->substr(h.pipelines_version.size());
            h.kept_pipelines = hash_of(*kept);
        }
    }
    guarded("creating a pipeline cache", [&] {
        h.pipelines = {h.device, {{}, bytes.size(), bytes.data()}};
    });
}

void keep_pipelines(const Context::Handles& h) noexcept {
    if (h.pipelines_file.empty() || !*h.pipelines) {
        return;
    }
    try {
        const auto data = h.pipelines.getData();
        const std::string bytes = h.pipelines_version + std::string(data.begin(), data.end());
        if (bytes.size() > kMostPipelineBytes) {
            std::filesystem::remove(h.pipelines_file);  // the next run begins anew
        } else if (hash_of(bytes) != h.kept_pipelines) {
            keep(h.pipelines_file, bytes);
        }
    } catch (const std::exception&) {
        // They will be compiled again.
    }
}

}  // namespace

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
    const auto devices = describe_all(physical, options.trials);
    const std::size_t chosen = choose_device(devices, options.device);
    h.physical = std::move(physical[chosen]);
    h.info = devices[chosen];
    h.info.limits.stages_uploads |= options.force_staging;
    h.info.limits.stages_downloads |= options.force_staging;
    auto& floats = h.info.limits.floats;
    floats.float64 &= !options.no_float64;
    floats.adds_float64 &= floats.float64;
    floats.both_to_nearest &= floats.float64;
    h.queue_family = *compute_queue_family(h.physical);
    if (h.info.limits.stages_uploads) {
        h.transfer_family = transfer_queue_family(h.physical);
    }
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
    if (allowed_subgroup_size(h.physical, h.info.limits.subgroup_size)) {
        extensions.push_back(kSubgroupSizeControl);
        h.subgroup_size_control = true;
        create.pNext = &size_control;
    }
    if (has_extension(h.physical, kPortabilitySubset)) {  // then it must be asked for
        extensions.push_back(kPortabilitySubset);
    }
    const float priority = 1.0F;
    std::vector<vk::DeviceQueueCreateInfo> queues = {{{}, h.queue_family, 1, &priority}};
    if (h.transfer_family) {
        queues.push_back({{}, *h.transfer_family, 1, &priority});
    }
    create.setQueueCreateInfos(queues);
    vk::PhysicalDeviceFeatures features;
    features.shaderFloat64 = floats.float64;
    create.pEnabledFeatures = &features;
    create.setPEnabledExtensionNames(extensions);
    guarded("vkCreateDevice (which needs memory and threads)", [&] {
        h.device = {h.physical, create};
        h.queue = {h.device, h.queue_family, 0};
        h.pool = {h.device, {vk::CommandPoolCreateFlagBits::eResetCommandBuffer, h.queue_family}};
        if (h.transfer_family) {
            h.transfer_queue = {h.device, *h.transfer_family, 0};
            h.transfer_pool = {
                h.device, {vk::CommandPoolCreateFlagBits::eResetCommandBuffer, *h.transfer_family}};
        }
    });
    open_pipelines(h, options.cache_directory);
    if (!h.subgroup_size_control) {
        check_subgroups(*this);
    }
}

Context::~Context() {
    keep_pipelines(*handles_);
}

const DeviceInfo& Context::info() const {
    return handles_->info;
}
bool Context::measures_time() const {
    return handles_->timestamp_seconds > 0;
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