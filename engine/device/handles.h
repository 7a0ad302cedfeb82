#pragma once

#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/device/context.h"
#include "engine/device/vulkan.h"

namespace merl::device {

/// The Vulkan objects behind a Context. Members are destroyed bottom up, so order matters.
struct Context::Handles {
    explicit Handles(vk::raii::Context&& loader_) : loader(std::move(loader_)) {}

    vk::raii::Context loader;
    vk::raii::Instance instance = nullptr;
    vk::raii::DebugUtilsMessengerEXT messenger = nullptr;
    vk::raii::PhysicalDevice physical = nullptr;
    vk::raii::Device device = nullptr;
    vk::raii::Queue queue = nullptr;
    vk::raii::CommandPool pool = nullptr;
    std::optional<std::uint32_t> transfer_family;  // what copies uploads; else the queue does
    vk::raii::Queue transfer_queue = nullptr;
    vk::raii::CommandPool transfer_pool = nullptr;
    vk::raii::PipelineCache pipelines = nullptr;  // compiled in this run and before
    vk::PhysicalDeviceMemoryProperties memory;
    std::uint32_t queue_family = 0;
    bool subgroup_size_control = false;  // a pipeline can ask for its subgroup size
    double timestamp_seconds = 0;        // seconds per timestamp tick; 0 without timestamps
    std::uint64_t timestamp_mask = 0;    // the bits of a timestamp that count
    DeviceInfo info;
    std::filesystem::path pipelines_file;  // where they are kept; empty: nowhere
    std::string pipelines_version;         // of the driver, with which they begin there
    std::string kept_pipelines;            // the hash of what was there; empty: nothing

    bool hangs = false;  // it did not end work in time: nothing waits for it any more

    std::uint64_t allocated = 0;
    std::uint64_t peak_allocated = 0;

    std::mutex message_lock;
    std::vector<std::string> messages;
};

/// Runs `call`; a Vulkan failure in it becomes an Error (device) that names `what` and the code, a
/// lost device a DeviceLostError.
template <typename Call>
auto guarded(const char* what, Call&& call) -> decltype(call()) {
    try {
        return call();
    } catch (const vk::DeviceLostError&) {
        throw DeviceLostError(std::string(what) +
                              " failed, the Vulkan device was lost: its driver was reset, or ended "
                              "work that took it too long");
    } catch (const vk::SystemError& error) {
        throw Error(Fault::device,
                    std::string(what) + " failed on the Vulkan device: " + error.what());
    }
}

}  // namespace merl::device
