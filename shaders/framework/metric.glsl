// What a metric file sees. "chosen_metric.glsl" is a generated file that includes one metric.

struct Voxel {
    float theta_h;  // half-difference angles of the voxel's centre, radians
    float theta_d;
    float phi_d;
    float cos_theta_i;
    float cos_theta_o;
    float s_merl;  // MERL scale factor
};

#include "lib/numerics.glsl"
#include "chosen_metric.glsl"

// Two ways to lay out a metric's grid, one rgba32f texel at a time.
#ifdef DEGREE_NUMERATOR
// The difference is a sum over channels of a homogeneous function of one channel's difference: the
// weight moves into the samples, and a texel is any four consecutive scalars of a material.
const uint kVoxelsPerCell = 4;
const uint kTexelsPerCell = 3;

// weight^(1/degree)
float folded(float weight) {
#if DEGREE_NUMERATOR == 2
    float root = sqrt(weight);
#elif DEGREE_NUMERATOR == 1
    float root = weight;
#else
#error "degree: the numerator must be 1 or 2"
#endif
    float power = 1.0;
    for (int i = 0; i < DEGREE_DENOMINATOR; ++i) {
        power *= root;
    }
    return power;
}

float texel_difference(vec4 a, vec4 b) {
    return (difference(a.x - b.x) + difference(a.y - b.y)) +
           (difference(a.z - b.z) + difference(a.w - b.w));
}
#else
// Any difference: a texel is one voxel's transformed sample and its weight.
const uint kVoxelsPerCell = 1;
const uint kTexelsPerCell = 1;

float texel_difference(vec4 a, vec4 b) { return a.w * difference(a.xyz, b.xyz); }
#endif

// Partial sums are over blocks of voxels; the host knows the same number.
const uint kBlockVoxels = 1024;
const uint kBlockTexels = kBlockVoxels / kVoxelsPerCell * kTexelsPerCell;
