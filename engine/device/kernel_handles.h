#pragma once

#include "engine/device/handles.h"
#include "engine/device/kernel.h"

namespace merl::device {

struct Kernel::Handles {
    std::string name;
    std::vector<Binding> bindings;
    std::uint32_t push_bytes = 0;
    vk::raii::DescriptorSetLayout set_layout = nullptr;
    vk::raii::PipelineLayout layout = nullptr;
    vk::raii::Pipeline pipeline = nullptr;
};

struct BoundKernel::Handles {
    const Kernel::Handles* kernel = nullptr;
    vk::raii::DescriptorPool pool = nullptr;
    vk::raii::DescriptorSet set = nullptr;
};

}  // namespace merl::device
