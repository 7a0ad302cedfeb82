#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// Adds a number of each lane of a subgroup.

#include "framework/add_lanes.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer Totals { float totals[]; };
layout(std430, binding = 1) readonly buffer Lost { float lost[]; };
layout(std430, binding = 2) writeonly buffer Sum { float sum; };

void main() {
    uint lane = gl_LocalInvocationID.x;
    float all = add_lanes(totals[lane], lost[lane]);
    if (lane == 0) {
        sum = all;
    }
}
