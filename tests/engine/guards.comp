#version 460
#extension GL_GOOGLE_include_directive : require

// Applies one operation to every three numbers, as a metric would that check_metric_code() and
// guard_metric_code() have seen. The test defines REAL, PAIR and EXPRESSION.

#include "framework/guards.glsl"

layout(local_size_x = 64) in;
layout(std430, binding = 0) readonly buffer In { REAL x[]; };
layout(std430, binding = 1) writeonly buffer Out { REAL y[]; };
layout(push_constant) uniform Push { uint size; };

REAL divided(REAL number, REAL divisor) { return number / divisor; }

REAL times(REAL number, REAL factor) { return number * factor; }

REAL over_count(REAL number) {
    REAL sum = REAL(0);
    for (int i = 0; i < 2; ++i) {
        sum += number / REAL(i);
    }
    return sum;
}

REAL difference(REAL a, REAL b, REAL c) { return EXPRESSION; }

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < size) {
        y[i] = difference(x[3 * i], x[3 * i + 1], x[3 * i + 2]);
    }
}
