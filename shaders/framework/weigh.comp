#version 460
#extension GL_GOOGLE_include_directive : require

// Voxels of a slab -> the weight volume: what every sample at a voxel is multiplied with, or for a
// metric without a degree, or where UNFOLDED, what its difference is.

#define METRIC_FLOAT64
#include "framework/metric.glsl"
#include "framework/geometry.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 1) writeonly buffer Weights { double weights[]; };  // per voxel

layout(push_constant) uniform Push {
    uint voxel_count;  // voxels of this slab; the last block is filled up with zeros
};

#if defined(DEGREE_NUMERATOR) && !defined(UNFOLDED)
// weight^(1/degree): a difference of that degree turns it into the weight again.
double folded(double weight) {
#if DEGREE_NUMERATOR == 2
    double root = sqrt(weight);
#elif DEGREE_NUMERATOR == 1
    double root = weight;
#else
#error "degree: the numerator must be 1 or 2"
#endif
    double power = 1.0;
    for (int i = 0; i < DEGREE_DENOMINATOR; ++i) {
        power *= root;
    }
    return power;
}
#else
double folded(double weight) { return weight; }
#endif

void main() {
    uint k = gl_GlobalInvocationID.x;
    double result = k < voxel_count ? folded(weight(fetch_voxel(k))) : 0.0;
#ifdef GUARDED
    result = guard_cut() || guard_faults != 0 ? nan64() : result;
#endif
    weights[k] = result;
}
