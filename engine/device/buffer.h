#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "engine/device/context.h"

namespace merl::device {

/// Where a buffer's bytes travel.
enum class Traffic {
    none,      // stays on the device
    upload,    // the host writes, kernels read
    download,  // kernels write, the host reads
};

/// How a buffer is read besides as a storage buffer: as a texel buffer of four 32-bit numbers a
/// texel.
enum class Texels { none, floats, words };

/// The device has too little memory left for a buffer.
class AllocationError : public Error {
  public:
    explicit AllocationError(const std::string& message) : Error(Fault::device, message) {}
};

/// Device memory that kernels use as a storage buffer, and as a texel buffer if asked.
///
/// Upload and download buffers can be reached from the host through `host()`. Where both sides
/// reach the device's memory (lavapipe, integrated GPUs, resizable BAR) that is the buffer itself;
/// elsewhere (Limits::stages_uploads, stages_downloads) it is a copy in memory of the host, as
/// large again, and Submission::upload and download do the copying.
class Buffer {
  public:
    /// Throws AllocationError that names the size when memory runs out, and Error (device) where
    /// the device has no memory of the kind at all.
    Buffer(Context& context, std::uint64_t bytes, Traffic traffic, Texels texels = Texels::none);
    ~Buffer();
    Buffer(Buffer&&) noexcept;
    Buffer& operator=(Buffer&&) noexcept;

    std::uint64_t bytes() const;

    /// The host's view, `bytes()` long; empty for Traffic::none.
    std::span<std::byte> host() const;

    template <typename T>
    std::span<T> host_as() const {
        const auto raw = host();
        return {reinterpret_cast<T*>(raw.data()), raw.size() / sizeof(T)};
    }

    struct Handles;
    Handles& handles() const { return *handles_; }

  private:
    std::unique_ptr<Handles> handles_;
};

}  // namespace merl::device
