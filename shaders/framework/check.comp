#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid and weights -> the first thing that is wrong with the metric, if anything is: for a
// metric that nobody has tested. Every voxel and wanted pair of materials is looked at. Three steps, each a
// dispatch: nothing found; search, where a workgroup is one subgroup and takes one block and one row of a
// tile; and by a single workgroup what the first of those that found something has to say.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"
#include "framework/pair_tile.glsl"

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
    // The first voxel at which the difference of a sample from itself is not zero, for a metric without a
    // degree; a material, and the difference.
    uint same_voxel;
    uint same_material;
    float same_difference;
}
finding;

layout(std430, binding = 3) readonly buffer TilePlaces { uvec2 tile_places[]; };

layout(push_constant) uniform Push {
    uint check_step;
    uint padded_materials;
    uint materials;
    uint groups;  // along x in the second step
};

const uint kNothing = 0xffffffffu;

const uint kFine = 0, kWeight = 1, kFirst = 2, kSecond = 3, kNotFinite = 4, kNegative = 5, kAsymmetric = 6,
           kDegree = 7, kFault = 8;

bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

double weight_at(uint voxel) {
    uvec4 words = texelFetch(weights, int(voxel / 2));
    return packDouble2x32(voxel % 2 == 0 ? words.xy : words.zw);
}

bool good_weight(double weight) {
    uint high = unpackDouble2x32(weight).y;
    return high < 0x7ff00000u || weight == 0.0;  // positive and finite, or a zero of either sign
}

// Whether a difference went wrong on the way, for which there is no number; `faults` says how.
bool faulty(inout float faults) {
#ifdef GUARDED
    if (guard_faults != 0) {
        faults = float(guard_faults);
        return true;
    }
#endif
    return false;
}

// What is wrong between two materials at one texel of a block; for kNotFinite and after, `there` and `back`
// are the differences. `scalar` is which of the texel's four, for a metric with a degree.
uint offence(uint block, uint texel, vec4 a, vec4 b, out uint scalar, out float there, out float back) {
    scalar = 0;
    there = 0.0;
    back = 0.0;
#ifdef GUARDED
    guard_faults = 0;
#endif
#ifdef DEGREE_NUMERATOR
    for (; scalar < 4; ++scalar) {
        uint voxel = block * kBlockVoxels + cell_of_texel(texel) * kCellVoxels + scalar;
        if (!good_weight(weight_at(voxel))) {
            return kWeight;
        }
        if (!is_finite(a[scalar]) || !is_finite(b[scalar])) {
            return is_finite(a[scalar]) ? kSecond : kFirst;
        }
        if (weight_at(voxel) == 0.0) {
            continue;  // beyond the last voxel, or of no weight
        }
        float d = a[scalar] - b[scalar];
        there = difference(d);
        back = difference(-d);
        if (faulty(there)) {
            return kFault;
        }
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
    if (faulty(there)) {
        return kFault;
    }
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
    return kFine;
}

bool is_finite(vec4 x) { return is_finite(x.x) && is_finite(x.y) && is_finite(x.z) && is_finite(x.w); }

// Whether something may be wrong: what offence() finds, in few instructions and without branches. A NaN
// makes every comparison false, where the device keeps it.
bool suspicious(uint block, uint texel, vec4 a, vec4 b) {
    bool fine = true;
#ifdef GUARDED
    guard_faults = 0;
#endif
    const float kLargest = 3.0e38;
#ifdef DEGREE_NUMERATOR
    vec4 d = a - b;
    vec4 there = vec4(difference(d.x), difference(d.y), difference(d.z), difference(d.w));
    vec4 back = vec4(difference(-d.x), difference(-d.y), difference(-d.z), difference(-d.w));
#if DEGREE_NUMERATOR < DEGREE_DENOMINATOR
    vec4 expected = vec4(two_thirds_power(d.x), two_thirds_power(d.y), two_thirds_power(d.z),
                         two_thirds_power(d.w));
#elif DEGREE_NUMERATOR == 1
    vec4 expected = abs(d);
    uint voxel = block * kBlockVoxels + cell_of_texel(texel) * kCellVoxels;
    fine = good_weight(weight_at(voxel)) && good_weight(weight_at(voxel + 1)) &&
           good_weight(weight_at(voxel + 2)) && good_weight(weight_at(voxel + 3));
#else
    vec4 expected = d * d;
#endif
    vec4 allowed = 1e-4 * expected + 1e-30;
    fine = fine && all(lessThanEqual(abs(there - expected), allowed)) &&
           all(lessThanEqual(abs(there - back), allowed));
#else
    float there = difference(a.xyz, b.xyz);
    float back = difference(b.xyz, a.xyz);
    float size_a = abs(a.x) + abs(a.y) + abs(a.z);
    float size_b = abs(b.x) + abs(b.y) + abs(b.z);
    fine = a.w >= 0.0 && a.w <= kLargest && size_a <= kLargest && size_b <= kLargest && there >= 0.0 &&
           back >= 0.0 && there <= kLargest && back <= kLargest &&
           abs(there - back) <= max(0.01 * max(there, back), 5e-7 * max(1.0, max(size_a, size_b)));
#endif
#ifndef KEEPS_NAN
    fine = fine && is_finite(a) && is_finite(b) && is_finite(there) && is_finite(back);
#endif
#ifdef GUARDED
    fine = fine && guard_faults == 0;
#endif
    return !fine;
}

// Whether a sample without a degree differs from itself.
bool differs_from_itself(vec4 a) {
#ifdef DEGREE_NUMERATOR
    return false;
#else
    return difference(a.xyz, a.xyz) != 0.0;
#endif
}

// Looks at a row of a tile in a block. The place of the first that is wrong, 65536 column + texel.
uint look(uint first, uvec2 tile, uint block) {
    uint from = block * padded_materials;
    uint worst = kNothing;
    uint same = kNothing;
    for (uint texel = gl_LocalInvocationID.x; texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
        vec4 a = texelFetch(grid, int((from + first) * kBlockTexels + texel));
#ifndef DEGREE_NUMERATOR
        if (a.w == 0.0) {
            continue;  // beyond the last voxel, or of no weight
        }
        if ((tile.x == tile.y || kTile == 1) && differs_from_itself(a)) {
            same = min(same, block * kBlockVoxels + texel);
        }
#endif
        for (uint column = 0; column < kTile; ++column) {
            uint second = tile.y + column;
            if (second <= first || second >= materials) {
                continue;
            }
            vec4 b = texelFetch(grid, int((from + second) * kBlockTexels + texel));
            // Of listed pairs there is no tile on the diagonal, where each material is a row once.
            if (kTile == 1 && differs_from_itself(b)) {
                same = min(same, block * kBlockVoxels + texel);
            }
            if (suspicious(block, texel, a, b)) {
                uint scalar;
                float there, back;
                uint at = 65536 * column + texel;
                worst = at < worst && offence(block, texel, a, b, scalar, there, back) != kFine ? at : worst;
            }
        }
    }
    same = subgroupMin(same);
    if (same != kNothing && gl_LocalInvocationID.x == 0) {
        atomicMin(finding.same_voxel, same);
    }
    return subgroupMin(worst);
}

// The material that differs from itself.
void describe_same() {
#ifndef DEGREE_NUMERATOR
    uint block = finding.same_voxel / kBlockVoxels;
    uint texel = finding.same_voxel % kBlockVoxels;
    for (uint material = 0; material < materials; ++material) {
        uint at = (block * padded_materials + material) * kBlockTexels + texel;
        vec4 a = texelFetch(grid, int(at));
        float d = difference(a.xyz, a.xyz);
        if (a.w != 0.0 && d != 0.0) {
            finding.same_material = material;
            finding.same_difference = d;
            return;
        }
    }
#endif
}

void describe(uint first, uvec2 tile, uint block, uint place) {
    uint texel = place % 65536;
    uint second = tile.y + place / 65536;
    uint from = block * padded_materials;
    vec4 a = texelFetch(grid, int((from + first) * kBlockTexels + texel));
    vec4 b = texelFetch(grid, int((from + second) * kBlockTexels + texel));
    uint scalar;
    float there, back;
    finding.kind = offence(block, texel, a, b, scalar, there, back);
    finding.there = there;
    finding.back = back;
    finding.first = first;
    finding.second = second;
#ifdef DEGREE_NUMERATOR
    uint voxel = cell_of_texel(texel) * kCellVoxels + scalar;
    finding.channel = channel_of_texel(texel);
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

void main() {
    if (check_step == 0) {
        finding.group = kNothing;
        finding.kind = kFine;
        finding.same_voxel = kNothing;
        return;
    }
    if (check_step == 2 && finding.same_voxel != kNothing && gl_LocalInvocationID.x == 0) {
        describe_same();
    }
    if (check_step == 2 && finding.group == kNothing) {
        return;
    }
    uint group_x = check_step == 1 ? gl_WorkGroupID.x : finding.group % groups;
    uint block = check_step == 1 ? gl_WorkGroupID.y : finding.group / groups;
    uvec2 tile = tile_places[group_x / kTile];
    uint first = tile.x + group_x % kTile;
    if (first >= materials) {
        return;
    }
    uint place = look(first, tile, block);
    bool cut = false;
#ifdef GUARDED
    cut = guard_cut();
    place = cut ? min(place, 0) : place;
#endif
    if (place != kNothing && gl_LocalInvocationID.x == 0) {
        if (check_step == 1) {
            atomicMin(finding.group, block * groups + group_x);
        } else {
            describe(first, tile, block, place);
#ifdef GUARDED
            if (cut) {
                finding.kind = kFault;
                finding.there = float(kEndlessLoop);
            }
#endif
        }
    }
}
