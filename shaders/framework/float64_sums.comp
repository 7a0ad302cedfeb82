#version 460
#extension GL_GOOGLE_include_directive : require

// Transformed samples and weights -> for each block and pair of a list the sum over its voxels of weight times
// |a - b|^degree, of all channels, all in float64. A workgroup takes one pair in one block. Sums have one order
// on every device: lanes, each over every WINDOW_LANES-th two voxels, and then each with the one half as many
// further on.

#include "lib/numerics.glsl"

layout(local_size_x_id = 0) in;  // WINDOW_LANES

layout(binding = 0) uniform usamplerBuffer grid;     // float64 [material][block][channel][voxel]
layout(binding = 1) uniform usamplerBuffer weights;  // float64 [voxel of the slab]
layout(std430, binding = 2) readonly buffer Pairs { uvec2 pairs[]; };      // places of materials
layout(std430, binding = 3) writeonly buffer Sums { double sums[]; };  // [block][pair]

layout(push_constant) uniform Push {
    uint slab_blocks;  // blocks between two materials
    uint pair_count;
};

shared double lanes[WINDOW_LANES];

dvec2 two_doubles(uvec4 words) { return dvec2(packDouble2x32(words.xy), packDouble2x32(words.zw)); }

double power(double d) {
#if DEGREE_NUMERATOR < DEGREE_DENOMINATOR
    return two_thirds_power(d);
#elif DEGREE_NUMERATOR == 1
    return abs(d);
#else
    return d * d;
#endif
}

void main() {
    uint pair = gl_WorkGroupID.x;
    uint block = gl_WorkGroupID.y;
    uint lane = gl_LocalInvocationID.x;
    const uint channel = BLOCK_VOXELS / 2;  // in texels
    uint first = (pairs[pair].x * slab_blocks + block) * 3 * channel;
    uint second = (pairs[pair].y * slab_blocks + block) * 3 * channel;
    precise double sum = 0.0lf;
    for (uint k = lane; k < channel; k += WINDOW_LANES) {
        precise dvec2 of_two = dvec2(0.0);
        for (uint c = 0; c < 3; ++c) {
            precise dvec2 d = two_doubles(texelFetch(grid, int(first + c * channel + k))) -
                              two_doubles(texelFetch(grid, int(second + c * channel + k)));
            of_two += dvec2(power(d.x), power(d.y));
        }
        // What has no weight may be infinite where samples are scaled.
        dvec2 weight = two_doubles(texelFetch(weights, int(block * channel + k)));
        precise dvec2 weighted = dvec2(weight.x == 0.0lf ? 0.0lf : weight.x * of_two.x,
                                       weight.y == 0.0lf ? 0.0lf : weight.y * of_two.y);
        sum += weighted.x + weighted.y;
    }
    lanes[lane] = sum;
    barrier();
    if (lane == 0) {
        for (uint half_lanes = WINDOW_LANES / 2; half_lanes > 0; half_lanes /= 2) {
            for (uint i = 0; i < half_lanes; ++i) {
                lanes[i] += lanes[i + half_lanes];
            }
        }
        sums[block * pair_count + pair] = lanes[0];
    }
}
