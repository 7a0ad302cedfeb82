#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid and weights -> the first thing that is wrong with the metric, if anything is: for a
// metric that nobody has tested. Every voxel and pair of materials is looked at. Three steps, each a
// dispatch: nothing found; search, where a workgroup is one subgroup and takes one block and one row of a
// tile; and by a single workgroup what the first of those that found something has to say.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"
#include "framework/tile.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;      // [block][material][texel]
layout(binding = 1) uniform usamplerBuffer weights;  // per voxel, float64

// The host has the same.
layout(std430, binding = 2) buffer Finding {
    uint group;  // the first that found something
    uint kind;
    uint first;  // materials
    uint second;
    uint voxel;    // of the slab
    uint channel;  // of the three, for a metric with a degree
    float a[3];    // transformed samples; for a metric with a degree one scalar, weighted
    float b[3];
    float there;  // difference(a, b) and difference(b, a)
    float back;
    float weight;
}
finding;

layout(push_constant) uniform Push {
    uint step;
    uint tiles_across;
    uint materials;
    uint groups;  // along x in the second step
};

const uint kNothing = 0xffffffffu;

const uint kFine = 0, kWeight = 1, kFirst = 2, kSecond = 3, kNotFinite = 4, kNegative = 5, kAsymmetric = 6,
           kDegree = 7, kLoops = 8;

bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

double weight_at(uint voxel) {
    uvec4 words = texelFetch(weights, int(voxel / 2));
    return packDouble2x32(voxel % 2 == 0 ? words.xy : words.zw);
}

bool good_weight(double weight) {
    uint high = unpackDouble2x32(weight).y;
    return high < 0x7ff00000u || weight == 0.0;  // positive and finite, or a zero of either sign
}

// What is wrong between two materials at one texel of a block; for kNotFinite and after, `there` and `back`
// are the differences. `scalar` is which of the texel's four, for a metric with a degree.
uint offence(uint block, uint texel, vec4 a, vec4 b, out uint scalar, out float there, out float back) {
    scalar = 0;
    there = 0.0;
    back = 0.0;
#ifdef DEGREE_NUMERATOR
    for (; scalar < 4; ++scalar) {
        uint voxel = block * kBlockVoxels + texel / kCellTexels * kCellVoxels +
                     (texel % kCellTexels * 4 + scalar) / 3;
        if (!good_weight(weight_at(voxel))) {
            return kWeight;
        }
        if (!is_finite(a[scalar]) || !is_finite(b[scalar])) {
            return is_finite(a[scalar]) ? kSecond : kFirst;
        }
        float d = a[scalar] - b[scalar];
        there = difference(d);
        back = difference(-d);
#if DEGREE_NUMERATOR < DEGREE_DENOMINATOR
        float expected = two_thirds_power(d);
#elif DEGREE_NUMERATOR == 1
        float expected = abs(d);
#else
        float expected = d * d;
#endif
        float allowed = 1e-4 * expected + 1e-30;
        if (!is_finite(expected)) {
            continue;  // beyond the range of float32: the sum will say so
        }
        if (!is_finite(there) || !is_finite(back)) {
            return kNotFinite;
        }
        if (there < 0.0 || back < 0.0) {
            return kNegative;
        }
        if (abs(there - back) > allowed) {
            return kAsymmetric;
        }
        if (abs(there - expected) > allowed) {
            return kDegree;
        }
    }
#else
    if (!good_weight(weight_at(block * kBlockVoxels + texel)) || !is_finite(a.w)) {
        return kWeight;
    }
    bool first_is_finite = is_finite(a.x) && is_finite(a.y) && is_finite(a.z);
    if (!first_is_finite || !is_finite(b.x) || !is_finite(b.y) || !is_finite(b.z)) {
        return first_is_finite ? kSecond : kFirst;
    }
    there = difference(a.xyz, b.xyz);
    back = difference(b.xyz, a.xyz);
    float size = max(1.0, max(length(a.xyz), length(b.xyz)));
    if (!is_finite(there) || !is_finite(back)) {
        return kNotFinite;
    }
    if (there < 0.0 || back < 0.0) {
        return kNegative;
    }
    if (abs(there - back) > max(0.01 * max(there, back), 1e-6 * size)) {
        return kAsymmetric;
    }
#endif
#ifdef COUNTED_LOOPS
    if (loops_ran_out()) {
        return kLoops;
    }
#endif
    return kFine;
}

// Looks at a row of a tile in a block; the first lane of the first offence writes it down if it is asked to.
bool look(uint group_x, uint block, bool write) {
    uvec2 tile = tile_at(group_x / kTile, tiles_across);
    uint first = tile.x * kTile + group_x % kTile;
    uint from = block * tiles_across * kTile;
    for (uint column = 0; column < kTile; ++column) {
        uint second = tile.y * kTile + column;
        if (second <= first || second >= materials) {
            continue;
        }
        uint worst = kNothing;
        for (uint texel = gl_LocalInvocationID.x; texel < kBlockTexels && worst == kNothing;
             texel += gl_WorkGroupSize.x) {
            vec4 a = texelFetch(grid, int((from + first) * kBlockTexels + texel));
            vec4 b = texelFetch(grid, int((from + second) * kBlockTexels + texel));
            uint scalar;
            float there, back;
            if (offence(block, texel, a, b, scalar, there, back) != kFine) {
                worst = texel;
            }
        }
        uint texel = subgroupMin(worst);
        if (texel == kNothing) {
            continue;
        }
        if (write && subgroupElect()) {
            vec4 a = texelFetch(grid, int((from + first) * kBlockTexels + texel));
            vec4 b = texelFetch(grid, int((from + second) * kBlockTexels + texel));
            uint scalar;
            finding.kind = offence(block, texel, a, b, scalar, finding.there, finding.back);
            finding.first = first;
            finding.second = second;
#ifdef DEGREE_NUMERATOR
            uint at = texel % kCellTexels * 4 + scalar;
            uint voxel = texel / kCellTexels * kCellVoxels + at / 3;
            finding.channel = at % 3;
            finding.a[0] = a[scalar];
            finding.b[0] = b[scalar];
#else
            uint voxel = texel;
            finding.channel = 0;
            for (uint i = 0; i < 3; ++i) {
                finding.a[i] = a[i];
                finding.b[i] = b[i];
            }
#endif
            finding.voxel = block * kBlockVoxels + voxel;
            finding.weight = float(weight_at(finding.voxel));
        }
        return true;
    }
    return false;
}

void main() {
    if (step == 0) {
        finding.group = kNothing;
        finding.kind = kFine;
    } else if (step == 1) {
        if (look(gl_WorkGroupID.x, gl_WorkGroupID.y, false) && subgroupElect()) {
            atomicMin(finding.group, gl_WorkGroupID.y * groups + gl_WorkGroupID.x);
        }
    } else if (finding.group != kNothing) {
        look(finding.group % groups, finding.group / groups, true);
    }
}
