#include "engine/device/context.h"

#include <algorithm>

#include "engine/base/error.h"
#include "engine/device/descriptions.h"
#include "engine/device/handles.h"
#include "engine/device/instance.h"

namespace merl::device {
namespace {

constexpr const char* kSubgroupSizeControl = VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME;

VKAPI_ATTR VkBool32 VKAPI_CALL keep_message(VkDebugUtilsMessageSeverityFlagBitsEXT,
                                            VkDebugUtilsMessageTypeFlagsEXT,
                                            const VkDebugUtilsMessengerCallbackDataEXT* data,
                                            void* user) {
    auto* handles = static_cast<Context::Handles*>(user);
    const std::lock_guard lock(handles->message_lock);
    handles->messages.emplace_back(data->pMessage);
    return VK_FALSE;
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
    const auto devices = describe_all(physical);
    const std::size_t chosen = choose_device(devices, options.device);
    h.physical = std::move(physical[chosen]);
    h.info = devices[chosen];
    h.info.limits.stages_uploads |= options.force_staging;
    h.info.limits.stages_downloads |= options.force_staging;
    auto& floats = h.info.limits.floats;
    floats.float64 &= !options.no_float64;
    floats.both_to_nearest &= floats.float64;
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
    features.shaderFloat64 = floats.float64;
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