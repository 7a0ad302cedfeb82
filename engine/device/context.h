#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace merl::device {

/// What the planner of device work must respect, as the driver reports it.
struct Limits {
    std::uint64_t storage_buffer_bytes = 0;  // largest range one storage buffer binding may cover
    std::uint64_t texel_buffer_texels = 0;   // largest texel buffer view, in texels
    std::uint64_t allocation_bytes = 0;      // largest single allocation
    std::uint64_t heap_bytes = 0;            // the device-local heap
    std::uint32_t groups_x = 0;              // workgroups per dimension of one dispatch
    std::uint32_t groups_y = 0;
    std::uint32_t subgroup_size = 0;  // lanes of one subgroup
    bool is_host = false;             // the device is the processor
};

/// One Vulkan device of this machine.
struct DeviceInfo {
    std::uint32_t index = 0;  // in the order of the Vulkan loader; what --device INDEX takes
    std::string name;
    std::string kind;    // "discrete GPU", "integrated GPU", "virtual GPU", "CPU" or "other"
    std::string driver;  // driver name and version
    std::string vulkan;  // Vulkan version
    Limits limits;
    std::optional<std::string> refusal;  // why it cannot be used; empty when it can
};

/// Every Vulkan device of this machine. An empty list means that there is no driver.
/// Throws Error (device) when the Vulkan loader is not installed.
std::vector<DeviceInfo> list_devices();

/// Why there is no device at all, for the user: "no Vulkan driver found" and what hides it or
/// leaves it no room, or else how to get one.
std::string why_no_device();

/// How a context is made; the defaults are what the command line uses.
struct ContextOptions {
    std::string device;          // empty: best usable one; else an index or a part of the name
    bool force_staging = false;  // copy through staging buffers even where memory can be mapped
};

/// A Vulkan device opened for compute: one queue, one command pool, the validation messages.
///
/// With MERL_SCAN_VALIDATE in the environment ("core", "sync" or "gpu") the Khronos
/// validation layer is loaded and every message of it is an error: see check_validation().
/// Sets LP_NATIVE_VECTOR_WIDTH in the environment to 512 where it is not set and the processor has
/// AVX-512: lavapipe does not choose that by itself.
class Context {
  public:
    /// Opens the chosen device, or without a choice the best usable one: discrete before
    /// integrated before virtual before CPU, then by index. Throws Error (device) that says which
    /// devices there are and why each was refused.
    explicit Context(const ContextOptions& options = {});
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    const DeviceInfo& info() const;
    const Limits& limits() const { return info().limits; }

    /// Bytes of Vulkan memory held by all live buffers of this context, and the most ever held.
    std::uint64_t allocated_bytes() const;
    std::uint64_t peak_allocated_bytes() const;

    /// Throws std::logic_error with every message the validation layer gave since the last call.
    void check_validation();

    struct Handles;  // the Vulkan objects, for the files of this folder only
    Handles& handles() { return *handles_; }

  private:
    std::unique_ptr<Handles> handles_;
};

}  // namespace merl::device
