#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/base/error.h"

namespace merl::device {

/// Materials along the side of the largest tile of pairs that is worth keeping in registers.
struct TileSides {
    std::uint32_t power = 10;   // under |d|^(2/3)
    std::uint32_t square = 10;  // under what is cheaper

    bool operator==(const TileSides&) const = default;
};

/// What a device's shaders can do with floating-point numbers, and what they can be told to do:
/// without being told it may round float32 either way, and treat NaN and infinity as any number
/// (Vulkan 1.2, "Precision and Operation of SPIR-V Instructions").
struct FloatControls {
    bool float64 = false;          // float64 in shaders
    bool adds_float64 = false;     // which takes no longer to add than float32
    bool to_nearest = false;       // round float32 to nearest
    bool both_to_nearest = false;  // where float64 must then be told the same
    bool keeps_nan = false;        // keep NaN, infinity and the sign of zero of float32
};

/// What the planner of device work must respect, as the driver reports it.
struct Limits {
    std::uint64_t storage_buffer_bytes = 0;  // largest range one storage buffer binding may cover
    std::uint64_t texel_buffer_texels = 0;   // largest texel buffer view, in texels
    std::uint64_t allocation_bytes = 0;      // largest single allocation
    std::uint64_t heap_bytes = 0;            // the device-local heap
    std::uint64_t free_bytes = 0;            // of that, what this process may still take
    std::uint32_t groups_x = 0;              // workgroups per dimension of one dispatch
    std::uint32_t groups_y = 0;
    std::uint32_t subgroup_size = 0;  // lanes of one subgroup
    bool is_host = false;             // the device is the processor, whatever it calls itself
    FloatControls floats = {};
    /// Whether what the host writes, and what it reads, are copies: it reaches no memory of the
    /// device, or only a part of it (a card without resizable BAR), which slabs would not fit into;
    /// and reading without a cache takes longer than copying.
    bool stages_uploads = false;
    bool stages_downloads = false;
    TileSides tiles = {};  // by what is known of the maker's devices, or measured in a trial
};

/// One Vulkan device of this machine.
struct DeviceInfo {
    std::uint32_t index = 0;  // in the order of the Vulkan loader; what --device INDEX takes
    std::string name;
    std::string kind;           // "discrete GPU", "integrated GPU", "virtual GPU", "CPU" or "other"
    std::string driver;         // driver name and version
    std::string vulkan;         // Vulkan version
    bool is_conformant = true;  // its driver has passed the tests of Khronos, by its own account
    Limits limits;
    std::optional<std::string> refusal;  // why it cannot be used; empty when it can
};

/// What came of trying a device, for those who did.
struct Trial {
    std::string device = {};              // the identity() that was tried
    std::string refusal = {};             // what went wrong; empty when nothing did
    bool loses_to_host = false;           // the processor without Vulkan is faster
    std::optional<TileSides> tiles = {};  // in which it was fastest, if that was measured

    bool operator==(const Trial&) const = default;
};

/// A device and its driver in their versions: what a trial is valid for.
std::string identity(const DeviceInfo& device);

/// What was tried, if it was.
const Trial* trial_of(const DeviceInfo& device, std::span<const Trial> trials);

/// There is no driver, or no loader, or they are hidden: a machine without a device.
class NoDriverError : public Error {
  public:
    NoDriverError(const std::string& message, bool is_installed)
        : Error(Fault::device, message), is_installed_(is_installed) {}

    /// Whether there is a driver that was kept from loading; otherwise installing one helps.
    bool is_installed() const { return is_installed_; }

  private:
    bool is_installed_;
};

/// The files that name drivers to the loader: those of the environment, or where packages put them.
std::vector<std::filesystem::path> driver_manifests();

/// Every Vulkan device of this machine; those that failed a trial are refused. Throws NoDriverError
/// when there is none.
std::vector<DeviceInfo> list_devices(std::span<const Trial> trials = {});

/// The index in `devices` of the one that `wanted` names by index or a part of its name; the best
/// usable one where it is empty: discrete before integrated before virtual before the processor,
/// drivers that are not conformant after all others, then by index. Throws Error (device) that says
/// which devices there are and why each was refused.
std::size_t choose_device(const std::vector<DeviceInfo>& devices, const std::string& wanted);

/// Sets LP_NATIVE_VECTOR_WIDTH in the environment to 512 where it is not set and the processor has
/// AVX-512: lavapipe does not choose that by itself. For a program, before it opens a device.
void widen_lavapipe();

}  // namespace merl::device
