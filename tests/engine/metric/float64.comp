#version 460
#extension GL_GOOGLE_include_directive : require

// Applies one float64 function of shaders/lib/ to every number, or pair of numbers.

#include "lib/float64.glsl"
#include "lib/numerics.glsl"

layout(local_size_x = 64) in;
layout(constant_id = 0) const uint function = 0;
layout(std430, binding = 0) readonly buffer In { dvec2 x[]; };
layout(std430, binding = 1) writeonly buffer Out { double y[]; };
layout(push_constant) uniform Push { uint size; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= size) {
        return;
    }
    double a = x[i].x;
    double b = x[i].y;
    switch (function) {
        case 0: y[i] = log(a); break;
        case 1: y[i] = log2(a); break;
        case 2: y[i] = exp(a); break;
        case 3: y[i] = exp2(a); break;
        case 4: y[i] = pow(a, b); break;
        case 5: y[i] = sin(a); break;
        case 6: y[i] = cos(a); break;
        case 7: y[i] = tan(a); break;
        case 8: y[i] = asin(a); break;
        case 9: y[i] = acos(a); break;
        case 10: y[i] = atan(a); break;
        case 11: y[i] = atan(a, b); break;
        case 12: y[i] = cube_root(a); break;
        case 13: y[i] = two_thirds_power(a); break;
        default: y[i] = 0.0;
    }
}
