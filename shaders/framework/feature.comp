#version 460
#extension GL_GOOGLE_include_directive : require

// Means over the windows of a user's summary metric -> its features. One invocation computes one feature of
// one row of means.

#define METRIC_FLOAT64
#include "framework/metric.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform usamplerBuffer means;  // float64 [row][window][channel]
layout(std430, binding = 1) writeonly buffer Features { double features[]; };  // [row][feature]

layout(push_constant) uniform Push {
    uint rows;
    uint feature_count;
};

double mean_at(uint at) {
    uvec4 two = texelFetch(means, int(at / 2));
    return packDouble2x32(at % 2 == 0 ? two.xy : two.zw);
}

void main() {
    uint row = gl_GlobalInvocationID.x;
    uint i = gl_WorkGroupID.y;
    if (row >= rows) {
        return;
    }
    Means m;
    for (uint w = 0; w < WINDOWS; ++w) {
        uint at = (row * WINDOWS + w) * 3;
        m.rgb[w] = dvec3(mean_at(at), mean_at(at + 1), mean_at(at + 2));
    }
    double result = feature(int(i), m);
#ifdef GUARDED
    result = guard_cut() || guard_faults != 0 ? nan64() : result;
#endif
    features[row * feature_count + i] = result;
}
