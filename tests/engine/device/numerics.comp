#version 460
#extension GL_GOOGLE_include_directive : require

// Applies one function of shaders/lib/numerics.glsl to every number.

#include "lib/numerics.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint function = 0;
layout(std430, binding = 0) readonly buffer In { float x[]; };
layout(std430, binding = 1) writeonly buffer Out { float y[]; };
layout(push_constant) uniform Push { uint size; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= size) {
        return;
    }
    switch (function) {
        case 0: y[i] = cube_root(x[i]); break;
        case 1: y[i] = two_thirds_power(x[i]); break;
        default: y[i] = x[i];
    }
}
