#include "engine/device/subgroup_check.h"

#include <fmt/format.h>

#include <cstdint>
#include <span>
#include <string>

#include "engine/base/error.h"
#include "engine/device/shader_compiler.h"
#include "engine/device/submission.h"

namespace merl::device {
namespace {

const ShaderText kLanes = {"subgroup check", R"glsl(#version 460
#extension GL_KHR_shader_subgroup_arithmetic : require

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) writeonly buffer Lanes { uint lanes; };  // of the first one's subgroup

void main() {
    uint all = subgroupAdd(1u);
    if (gl_LocalInvocationID.x == 0) {
        lanes = all;
    }
}
)glsl"};

}  // namespace

void check_subgroups(Context& context) {
    const std::uint32_t expected = context.limits().subgroup_size;
    const auto no_files = [](std::string_view, std::string_view) { return nullptr; };
    const Kernel kernel(context, kLanes.name, compile_shader(kLanes, "", no_files),
                        {.bindings = {Binding::storage},
                         .constants = {expected},
                         .push_bytes = 0,
                         .one_subgroup = true});
    Buffer lanes(context, sizeof(std::uint32_t), Traffic::download);
    Buffer* const buffers[] = {&lanes};
    const BoundKernel bound(context, kernel, buffers);
    Submission work(context);
    work.begin();
    work.dispatch(bound, {}, 1, 1);
    work.download(lanes, lanes.bytes());
    work.submit();
    work.wait();
    const auto found = lanes.host_as<const std::uint32_t>().front();
    if (found != expected) {
        throw UnfitError(
            fmt::format("{} says that a subgroup has {} lanes, and a workgroup of as many was not "
                        "one: {} lanes "
                        "added up. Its sums would be wrong; `merl-scan devices` "
                        "lists others, and --device host needs none",
                        context.info().name, expected, found));
    }
}

}  // namespace merl::device
