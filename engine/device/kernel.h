#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "engine/device/buffer.h"
#include "engine/device/context.h"

namespace merl::device {

/// How a shader sees the buffer at one binding of set 0.
enum class Binding { storage, texels };

/// A compute pipeline: one shader, its bindings in order 0, 1, 2 … of set 0, its specialization
/// constants in order of constant_id 0, 1, 2 …, and a block of push constants.
class Kernel {
  public:
    struct Options {
        std::vector<Binding> bindings;
        std::vector<std::uint32_t> constants;
        std::uint32_t push_bytes = 0;
        bool one_subgroup = false;  // the workgroup is exactly one subgroup of the reported size
    };

    /// `name` is for error messages. Throws Error (device) when the driver refuses the shader.
    Kernel(Context& context, const std::string& name, std::span<const std::uint32_t> spirv,
           const Options& options);
    ~Kernel();
    Kernel(Kernel&&) noexcept;
    Kernel& operator=(Kernel&&) noexcept;

    struct Handles;
    Handles& handles() const { return *handles_; }

  private:
    std::unique_ptr<Handles> handles_;
};

/// A kernel together with the buffers it works on. The buffers must outlive it.
class BoundKernel {
  public:
    BoundKernel(Context& context, const Kernel& kernel, std::span<Buffer* const> buffers);
    ~BoundKernel();
    BoundKernel(BoundKernel&&) noexcept;
    BoundKernel& operator=(BoundKernel&&) noexcept;

    struct Handles;
    Handles& handles() const { return *handles_; }

  private:
    std::unique_ptr<Handles> handles_;
};

}  // namespace merl::device
