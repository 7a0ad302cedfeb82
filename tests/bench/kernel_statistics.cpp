// What a driver's compiler makes of the kernels of metrics: its statistics of each (registers,
// spills, size of the code), as CSV. Nothing is run, so the device may be one that only compiles
// (scripts/amd_kernels.sh).
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <map>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "engine/base/error.h"
#include "engine/device/descriptions.h"
#include "engine/device/handles.h"
#include "engine/device/instance.h"
#include "engine/device/vulkan.h"
#include "engine/metric/metric.h"
#include "engine/metric/metric_kernels.h"

namespace merl::bench {
namespace {

constexpr const char* kStatistics = VK_KHR_PIPELINE_EXECUTABLE_PROPERTIES_EXTENSION_NAME;

/// A device with the statistics of its pipelines switched on.
struct Compiler {
    explicit Compiler(const std::string& wanted);

    vk::raii::Context loader = device::make_loader();
    vk::raii::Instance instance = device::make_instance(loader, "");
    vk::raii::PhysicalDevice physical = nullptr;
    vk::raii::Device device = nullptr;
    std::string name;
    device::FloatControls floats;
    std::vector<std::uint32_t> subgroup_sizes;  // the one that the engine takes is the first
};

Compiler::Compiler(const std::string& wanted) {
    auto all = device::enumerate(instance);
    const auto infos = device::describe_all(all, {});
    const auto chosen = device::choose_device(infos, wanted);
    physical = std::move(all[chosen]);
    name = infos[chosen].name;
    floats = infos[chosen].limits.floats;
    for (const char* extension : {kStatistics, VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME}) {
        if (!device::has_extension(physical, extension)) {
            throw Error(Fault::device, fmt::format("{} does not offer {}", name, extension));
        }
    }
    const auto sizes = physical
                           .getProperties2<vk::PhysicalDeviceProperties2,
                                           vk::PhysicalDeviceSubgroupSizeControlProperties>()
                           .get<vk::PhysicalDeviceSubgroupSizeControlProperties>();
    const auto own = infos[chosen].limits.subgroup_size;
    subgroup_sizes = {own};
    for (auto size = sizes.minSubgroupSize; size <= sizes.maxSubgroupSize; size *= 2) {
        if (size != own) {
            subgroup_sizes.push_back(size);
        }
    }
    vk::PhysicalDevicePipelineExecutablePropertiesFeaturesKHR statistics(true);
    vk::PhysicalDeviceSubgroupSizeControlFeaturesEXT size_control(true, true, &statistics);
    vk::PhysicalDeviceFeatures features;
    features.shaderFloat64 = floats.float64;
    const float priority = 1.0F;
    const vk::DeviceQueueCreateInfo queue({}, device::compute_queue_family(physical).value(), 1,
                                          &priority);
    const auto extensions = {kStatistics, VK_EXT_SUBGROUP_SIZE_CONTROL_EXTENSION_NAME};
    device = {physical, vk::DeviceCreateInfo({}, queue, {}, extensions, &features, &size_control)};
}

/// A kernel as engine/distance/vulkan/vulkan_metric.cpp makes it.
struct Kernel {
    std::string name;
    std::span<const std::uint32_t> spirv;
    std::vector<std::uint32_t> constants;
    std::uint32_t texel_buffers = 1;  // at the first bindings; the one after them is for storage
    std::uint32_t subgroup_size = 0;  // that the workgroup is; 0 if it is not one subgroup
};

/// Of one metric: tile sides matter to kernels of pairs only, and are 0 in the others.
struct Row {
    std::uint32_t side = 0;
    Kernel kernel;
};

std::vector<Row> rows_of(const engine::Metric& metric, const engine::MetricKernels& spirv,
                         std::span<const std::uint32_t> sides,
                         std::span<const std::uint32_t> subgroup_sizes) {
    constexpr std::uint32_t kLanes = 64;
    std::vector<Row> rows = {{0, {"weigh", spirv.weigh, {kLanes}, 1, 0}},
                             {0, {"prepare", spirv.prepare, {kLanes}, 3, 0}}};
    for (const auto lanes : subgroup_sizes) {
        for (const auto& [name, words] :
             {std::pair("norms", &spirv.norms), {"ranges", &spirv.ranges}}) {
            rows.push_back({0, {name, *words, {lanes, 0, 1}, 1, lanes}});
        }
        for (const auto side : sides) {
            for (const auto& [name, words] :
                 {std::pair("difference", &spirv.difference), {"slopes", &spirv.slopes}}) {
                rows.push_back({side, {name, *words, {lanes, 0, side}, 1, lanes}});
                if (metric.has_degree()) {
                    const auto diagonal = fmt::format("diagonal {}", name);
                    rows.push_back({side, {diagonal, *words, {lanes, 1, side}, 1, lanes}});
                }
            }
        }
    }
    std::erase_if(rows, [](const Row& row) { return row.kernel.spirv.empty(); });
    return rows;
}

/// Name and value, in the driver's order.
using Statistics = std::vector<std::pair<std::string, std::string>>;

Statistics compile(const Compiler& compiler, const Kernel& kernel) {
    const auto& device = compiler.device;
    std::vector<vk::DescriptorSetLayoutBinding> bindings;
    for (std::uint32_t i = 0; i <= kernel.texel_buffers; ++i) {
        bindings.emplace_back(i,
                              i < kernel.texel_buffers ? vk::DescriptorType::eUniformTexelBuffer
                                                       : vk::DescriptorType::eStorageBuffer,
                              1, vk::ShaderStageFlagBits::eCompute);
    }
    const vk::raii::DescriptorSetLayout set(device, {{}, bindings});
    const vk::PushConstantRange push(vk::ShaderStageFlagBits::eCompute, 0, 16);
    const vk::raii::PipelineLayout layout(device, {{}, *set, push});
    std::vector<vk::SpecializationMapEntry> entries;
    for (std::uint32_t i = 0; i < kernel.constants.size(); ++i) {
        entries.emplace_back(i, i * 4, 4);
    }
    const vk::SpecializationInfo specialization(static_cast<std::uint32_t>(entries.size()),
                                                entries.data(), kernel.constants.size() * 4,
                                                kernel.constants.data());
    const vk::raii::ShaderModule module(device,
                                        {{}, kernel.spirv.size_bytes(), kernel.spirv.data()});
    vk::PipelineShaderStageCreateInfo stage({}, vk::ShaderStageFlagBits::eCompute, *module, "main",
                                            &specialization);
    const vk::PipelineShaderStageRequiredSubgroupSizeCreateInfoEXT size(kernel.subgroup_size);
    if (kernel.subgroup_size > 0) {
        stage.flags |= vk::PipelineShaderStageCreateFlagBits::eRequireFullSubgroupsEXT;
        stage.pNext = &size;
    }
    const vk::raii::Pipeline pipeline(
        device, nullptr,
        vk::ComputePipelineCreateInfo(vk::PipelineCreateFlagBits::eCaptureStatisticsKHR |
                                          vk::PipelineCreateFlagBits::eDispatchBase,
                                      stage, *layout));
    Statistics statistics;
    for (const auto& s : device.getPipelineExecutableStatisticsKHR({*pipeline, 0})) {
        const auto value = [&]() -> std::string {
            switch (s.format) {
                case vk::PipelineExecutableStatisticFormatKHR::eBool32:
                    return fmt::format("{}", s.value.b32);
                case vk::PipelineExecutableStatisticFormatKHR::eInt64:
                    return fmt::format("{}", s.value.i64);
                case vk::PipelineExecutableStatisticFormatKHR::eUint64:
                    return fmt::format("{}", s.value.u64);
                case vk::PipelineExecutableStatisticFormatKHR::eFloat64:
                    return fmt::format("{}", s.value.f64);
            }
            return "";
        };
        statistics.emplace_back(s.name.data(), value());
    }
    return statistics;
}

int run(int argc, char** argv) {
    CLI::App program("What a driver's compiler makes of the kernels of metrics, as CSV.");
    std::string wanted;
    std::vector<std::string> names = {"cwcbrt", "pawcielab"};
    std::vector<std::uint32_t> sides = {3, 4, 5, 6, 7, 8, 9, 10};
    program.add_option("--device", wanted, "A Vulkan device by number or part of its name");
    program.add_option("--metrics", names, "Metrics, or files of them")->delimiter(',');
    program.add_option("--sides", sides, "Materials along a side of a tile of pairs")
        ->delimiter(',')
        ->check(CLI::PositiveNumber);
    CLI11_PARSE(program, argc, argv);

    const Compiler compiler(wanted);
    std::vector<std::string> columns;  // those of the first kernel
    for (const auto& name : names) {
        const auto metric = engine::open_metric(name);
        const auto spirv = engine::compile_kernels(metric, compiler.floats);
        for (const auto& [side, kernel] : rows_of(metric, spirv, sides, compiler.subgroup_sizes)) {
            const auto statistics = compile(compiler, kernel);
            if (columns.empty()) {
                fmt::print("device,metric,kernel,side,subgroup");
                for (const auto& [column, value] : statistics) {
                    columns.push_back(column);
                    fmt::print(",{}", column);
                }
                fmt::print("\n");
            }
            fmt::print("{},{},{},{},{}", compiler.name, metric.name, kernel.name, side,
                       kernel.subgroup_size);
            const std::map<std::string, std::string> values(statistics.begin(), statistics.end());
            for (const auto& column : columns) {
                const auto found = values.find(column);
                fmt::print(",{}", found == values.end() ? "" : found->second);
            }
            fmt::print("\n");
            std::fflush(stdout);
        }
    }
    return 0;
}

}  // namespace
}  // namespace merl::bench

int main(int argc, char** argv) {
    try {
        return merl::bench::run(argc, argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "{}\n", error.what());
        return 1;
    }
}
