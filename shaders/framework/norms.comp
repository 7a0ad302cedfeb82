#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid -> partial sums of the difference from zero, for each block and each material: what
// the error bound of a distance is made of. A workgroup is one subgroup.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                         // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Norms { float norms[]; };  // [block][material]

void main() {
    uint row = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    float sum = 0.0;
    for (uint texel = gl_LocalInvocationID.x; texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
        sum += texel_difference(texelFetch(grid, int(row * kBlockTexels + texel)), vec4(0.0));
    }
    float total = subgroupAdd(sum);
    if (gl_LocalInvocationID.x == 0) {
        norms[row] = total;
    }
}
