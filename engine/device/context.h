#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/device/devices.h"

namespace merl::device {

/// The device stopped for good: its driver was reset, or it ended work that took too long.
class DeviceLostError : public Error {
  public:
    explicit DeviceLostError(const std::string& message) : Error(Fault::device, message) {}
};

/// The device does not compute what it should.
class UnfitError : public Error {
  public:
    explicit UnfitError(const std::string& message) : Error(Fault::device, message) {}
};

/// How a context is made; the defaults are what the command line uses.
struct ContextOptions {
    std::string device = {};     // empty: best usable one; else an index or a part of the name
    bool force_staging = false;  // copy through staging buffers even where memory can be mapped
    bool no_float64 = false;     // do without it even where shaders have it
    std::filesystem::path cache_directory = {};  // keeps compiled pipelines; empty: nothing does
    std::vector<Trial> trials = {};              // what is known of the devices
};

/// A Vulkan device opened for compute: one queue, one command pool, the validation messages.
///
/// With MERL_SCAN_VALIDATE in the environment ("core", "sync" or "gpu") the Khronos
/// validation layer is loaded and every message of it is an error: see check_validation().
class Context {
  public:
    /// Opens the chosen device (choose_device). Throws Error (device).
    explicit Context(const ContextOptions& options = {});
    ~Context();
    Context(const Context&) = delete;
    Context& operator=(const Context&) = delete;

    const DeviceInfo& info() const;
    const Limits& limits() const { return info().limits; }

    /// Whether the device measures how long its work takes (Submission::seconds).
    bool measures_time() const;

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
