#include "engine/device/kernel.h"

#include <fmt/format.h>

#include "engine/base/error.h"
#include "engine/device/buffer_handles.h"
#include "engine/device/kernel_handles.h"

namespace merl::device {
namespace {

vk::DescriptorType descriptor_type(Binding binding) {
    return binding == Binding::texels ? vk::DescriptorType::eUniformTexelBuffer
                                      : vk::DescriptorType::eStorageBuffer;
}

}  // namespace

Kernel::Kernel(Context& context, const std::string& name, std::span<const std::uint32_t> spirv,
               const Options& options)
    : handles_(std::make_unique<Handles>()) {
    auto& c = context.handles();
    auto& h = *handles_;
    h.name = name;
    h.bindings = options.bindings;
    h.push_bytes = options.push_bytes;
    guarded(fmt::format("building the kernel \"{}\"", name).c_str(), [&] {
        std::vector<vk::DescriptorSetLayoutBinding> bindings;
        for (std::uint32_t i = 0; i < options.bindings.size(); ++i) {
            bindings.emplace_back(i, descriptor_type(options.bindings[i]), 1,
                                  vk::ShaderStageFlagBits::eCompute);
        }
        h.set_layout = {c.device, {{}, bindings}};
        const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, options.push_bytes);
        vk::PipelineLayoutCreateInfo layout({}, *h.set_layout);
        if (options.push_bytes > 0) {
            layout.setPushConstantRanges(push);
        }
        h.layout = {c.device, layout};

        std::vector<vk::SpecializationMapEntry> entries;
        for (std::uint32_t i = 0; i < options.constants.size(); ++i) {
            entries.emplace_back(i, i * 4, 4);
        }
        const vk::SpecializationInfo specialization(static_cast<std::uint32_t>(entries.size()),
                                                    entries.data(), options.constants.size() * 4,
                                                    options.constants.data());
        const vk::raii::ShaderModule module(c.device, {{}, spirv.size_bytes(), spirv.data()});
        vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module,
                                                "main", &specialization);
        const vk::PipelineShaderStageRequiredSubgroupSizeCreateInfoEXT size(
            c.info.limits.subgroup_size);
        if (options.one_subgroup && c.subgroup_size_control) {
            stage.flags |= vk::PipelineShaderStageCreateFlagBits::eRequireFullSubgroupsEXT;
            stage.pNext = &size;
        }
        // Any kernel may be cut into ranges of workgroups.
        h.pipeline = {c.device, c.pipelines,
                      vk::ComputePipelineCreateInfo(vk::PipelineCreateFlagBits::eDispatchBase,
                                                    stage, *h.layout)};
    });
}

Kernel::~Kernel() = default;
Kernel::Kernel(Kernel&&) noexcept = default;
Kernel& Kernel::operator=(Kernel&&) noexcept = default;

BoundKernel::BoundKernel(Context& context, const Kernel& kernel, std::span<Buffer* const> buffers)
    : handles_(std::make_unique<Handles>()) {
    auto& c = context.handles();
    auto& h = *handles_;
    const auto& k = kernel.handles();
    h.kernel = &k;
    if (buffers.size() != k.bindings.size()) {
        throw std::logic_error(fmt::format("kernel \"{}\" takes {} buffers and got {}", k.name,
                                           k.bindings.size(), buffers.size()));
    }
    guarded("binding buffers", [&] {
        std::vector<vk::DescriptorPoolSize> sizes;
        for (const auto binding : k.bindings) {
            sizes.emplace_back(descriptor_type(binding), 1);
        }
        h.pool = {c.device, {vk::DescriptorPoolCreateFlagBits::eFreeDescriptorSet, 1, sizes}};
        h.set = std::move(vk::raii::DescriptorSets(c.device, {*h.pool, *k.set_layout}).front());
        for (std::uint32_t i = 0; i < buffers.size(); ++i) {
            const auto& b = buffers[i]->handles();
            const vk::DescriptorBufferInfo whole(*b.device->buffer, 0, VK_WHOLE_SIZE);
            vk::WriteDescriptorSet write(*h.set, i, 0, 1, descriptor_type(k.bindings[i]));
            if (k.bindings[i] == Binding::texels) {
                write.pTexelBufferView = &*b.texels;
            } else {
                write.pBufferInfo = &whole;
            }
            c.device.updateDescriptorSets(write, {});
        }
    });
}

BoundKernel::~BoundKernel() = default;
BoundKernel::BoundKernel(BoundKernel&&) noexcept = default;
BoundKernel& BoundKernel::operator=(BoundKernel&&) noexcept = default;

}  // namespace merl::device
