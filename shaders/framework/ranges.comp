#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// A metric's grid -> the smallest and the largest number of each chunk of each material, from which
// slopes.comp bounds what the rounding of samples can change. A workgroup is one subgroup and takes one
// block of one material.

#include "framework/metric.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                         // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Ranges { vec4 ranges[]; };  // [block][material][chunk/2]

vec2 range_of_chunk(uint row, uint chunk) {
    int first = int(row * kBlockTexels + chunk * kChunkTexels);
    vec4 low = texelFetch(grid, first);
    vec4 high = low;
    [[unroll]] for (uint i = 1; i < kChunkTexels; ++i) {
        vec4 texel = texelFetch(grid, first + int(i));
        low = min(low, texel);
        high = max(high, texel);
    }
    return vec2(min(min(low.x, low.y), min(low.z, low.w)), max(max(high.x, high.y), max(high.z, high.w)));
}

void main() {
    const uint kTexels = kBlockTexels / kChunkTexels / 2;  // of ranges, of one block and material
    uint row = gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x;
    for (uint texel = gl_LocalInvocationID.x; texel < kTexels; texel += gl_WorkGroupSize.x) {
        ranges[row * kTexels + texel] =
            vec4(range_of_chunk(row, 2 * texel), range_of_chunk(row, 2 * texel + 1));
    }
}
