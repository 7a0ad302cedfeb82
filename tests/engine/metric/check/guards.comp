#version 460
#extension GL_GOOGLE_include_directive : require

// Applies one operation to every three numbers, as a metric would that check_metric_code() and
// guard_metric_code() have seen. The test defines REAL, the PAIR, TRIPLE and MATRIX of it, and EXPRESSION.

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

const REAL kSmall[3] = REAL[](REAL(0), REAL(1), REAL(2));
const MATRIX kDiagonal = MATRIX(REAL(0), REAL(1), REAL(1), REAL(2));
// Larger than what the guards look through.
const REAL kLarge[80] = REAL[](
    REAL(0), REAL(2), REAL(3), REAL(4), REAL(5), REAL(6), REAL(7), REAL(1), REAL(2), REAL(3),
    REAL(4), REAL(5), REAL(6), REAL(7), REAL(1), REAL(2), REAL(3), REAL(4), REAL(5), REAL(6),
    REAL(7), REAL(1), REAL(2), REAL(3), REAL(4), REAL(5), REAL(6), REAL(7), REAL(1), REAL(2),
    REAL(3), REAL(4), REAL(5), REAL(6), REAL(7), REAL(1), REAL(2), REAL(3), REAL(4), REAL(5),
    REAL(0), REAL(7), REAL(1), REAL(2), REAL(3), REAL(4), REAL(5), REAL(6), REAL(7), REAL(1),
    REAL(2), REAL(3), REAL(4), REAL(5), REAL(6), REAL(7), REAL(1), REAL(2), REAL(3), REAL(4),
    REAL(5), REAL(6), REAL(7), REAL(1), REAL(2), REAL(3), REAL(4), REAL(5), REAL(6), REAL(7),
    REAL(1), REAL(2), REAL(3), REAL(4), REAL(5), REAL(6), REAL(7), REAL(1), REAL(2), REAL(3));

REAL small(int i) { return kSmall[i]; }

REAL diagonal(int i) { return kDiagonal[i][i]; }

REAL large(int i) { return kLarge[i]; }

#define SUM(name, numbers, count)                                 \
    REAL name(REAL number) {                                      \
        REAL sum = number;                                        \
        for (int i = 0; i < count; ++i) {                         \
            sum += numbers * (REAL(1) / numbers) * REAL(0);       \
        }                                                         \
        return sum;                                               \
    }
SUM(sum_of_small, kSmall[i], 3)
SUM(sum_of_diagonal, kDiagonal[i][i], 2)
SUM(sum_of_large, kLarge[i], 80)

REAL difference(REAL a, REAL b, REAL c) { return EXPRESSION; }

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < size) {
        y[i] = difference(x[3 * i], x[3 * i + 1], x[3 * i + 2]);
    }
}
