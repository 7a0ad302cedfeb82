#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid and weights -> the first thing that is wrong with the metric, if anything is: for a
// metric that nobody has tested. Every voxel of every material is looked at, and the differences of some pairs, in
// which each material is; of a metric without a degree any_difference.comp looks at all pairs. Three steps, each a
// dispatch: nothing found; search, where a workgroup is one subgroup and takes one block and one pair; and by
// a single workgroup what the first that found something has to say, of those here or in any_difference.comp.

#define FINDING_BINDING 2
#include "framework/metric.glsl"
#include "framework/pair_tile.glsl"
#include "framework/finding.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;      // [block][material][texel]
layout(binding = 1) uniform usamplerBuffer weights;  // per voxel, float64

layout(std430, binding = 3) readonly buffer TilePlaces { uvec2 tile_places[]; };  // and after them the pairs

layout(push_constant) uniform Push {
    uint check_step;
    uint padded_materials;
    uint materials;
    uint tile_count;
    uint pairs;  // that are looked at
};

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
        uint kind = degree_offence(a[scalar] - b[scalar], there, back);
        if (kind != kFine) {
            return kind;
        }
    }
    return kFine;
#else
    if (!good_weight(weight_at(block * kBlockVoxels + texel)) || !is_finite(a.w)) {
        return kWeight;
    }
    bool first_is_finite = is_finite(a.x) && is_finite(a.y) && is_finite(a.z);
    if (!first_is_finite || !is_finite(b.x) || !is_finite(b.y) || !is_finite(b.z)) {
        return first_is_finite ? kSecond : kFirst;
    }
    guard_faults = 0;
    there = difference(a.xyz, b.xyz);
    back = difference(b.xyz, a.xyz);
    if (is_faulty(there)) {
        return kFault;
    }
    if (!is_finite(there) || !is_finite(back)) {
        return kNotFinite;
    }
    if (there < 0.0 || back < 0.0) {
        return kNegative;
    }
    return abs(there - back) > allowed_asymmetry(a.xyz, b.xyz, there, back) ? kAsymmetric : kFine;
#endif
}

bool is_finite(vec4 x) { return is_finite(x.x) && is_finite(x.y) && is_finite(x.z) && is_finite(x.w); }

// Whether something may be wrong: what offence() finds, in few instructions and without branches. A NaN
// makes every comparison false, where the device keeps it.
bool suspicious(uint block, uint texel, vec4 a, vec4 b) {
    bool fine = true;
    guard_faults = 0;
    const float kLargest = 3.0e38;
#ifdef DEGREE_NUMERATOR
    vec4 d = a - b;
    vec4 there = vec4(difference(d.x), difference(d.y), difference(d.z), difference(d.w));
    vec4 back = vec4(difference(-d.x), difference(-d.y), difference(-d.z), difference(-d.w));
    vec4 expected = vec4(expected_difference(d.x), expected_difference(d.y), expected_difference(d.z),
                         expected_difference(d.w));
    uint voxel = block * kBlockVoxels + cell_of_texel(texel) * kCellVoxels;
    fine = good_weight(weight_at(voxel)) && good_weight(weight_at(voxel + 1)) &&
           good_weight(weight_at(voxel + 2)) && good_weight(weight_at(voxel + 3));
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
    fine = fine && guard_faults == 0;
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

// Looks at a material against some that follow each other in a block. The place of the first that is wrong,
// 65536 column + texel; and in the first of them, where a sample differs from itself. What is wrong is found
// out in a second loop, which hardly ever begins: lavapipe skips no branch.
uint look(uint first, uint second_from, uint columns, uint block, bool looks_at_same) {
    uint from = block * padded_materials;
    uint same = kNothing;
    uint doubts = 0;
    for (uint texel = gl_LocalInvocationID.x; texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
        vec4 a = texelFetch(grid, int((from + first) * kBlockTexels + texel));
#ifndef DEGREE_NUMERATOR
        if (a.w == 0.0) {
            continue;  // beyond the last voxel, or of no weight
        }
        if (looks_at_same && differs_from_itself(a)) {
            same = min(same, block * kBlockVoxels + texel);
        }
#endif
        for (uint column = 0; column < columns; ++column) {
            uint second = second_from + column;
            if (second <= first || second >= materials) {
                continue;
            }
            vec4 b = texelFetch(grid, int((from + second) * kBlockTexels + texel));
            if (looks_at_same && differs_from_itself(b)) {
                same = min(same, block * kBlockVoxels + texel);
            }
            doubts |= suspicious(block, texel, a, b) ? 1 : 0;
        }
    }
    uint worst = kNothing;
    bool again = subgroupMax(doubts) != 0;
    guard_loops = 0;  // so that a loop that has no end is found where it is
    for (uint texel = gl_LocalInvocationID.x; again && texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
        vec4 a = texelFetch(grid, int((from + first) * kBlockTexels + texel));
#ifndef DEGREE_NUMERATOR
        if (a.w == 0.0) {
            continue;
        }
#endif
        for (uint column = 0; column < columns; ++column) {
            uint second = second_from + column;
            if (second <= first || second >= materials) {
                continue;
            }
            vec4 b = texelFetch(grid, int((from + second) * kBlockTexels + texel));
            uint scalar;
            float there, back;
            uint at = 65536 * column + texel;
            worst = at < worst && offence(block, texel, a, b, scalar, there, back) != kFine ? at : worst;
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

void describe(uint first, uint second_from, uint block, uint place) {
    uint texel = place % 65536;
    uint second = second_from + place / 65536;
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
        finding.pair = kNothing;
        finding.row = kNothing;
        finding.row_faults = 0;
        finding.number = kNothing;
        finding.kind = kFine;
        finding.same_voxel = kNothing;
        return;
    }
    if (check_step == 2 && finding.same_voxel != kNothing && gl_LocalInvocationID.x == 0) {
        describe_same();
    }
    bool of_row = check_step == 2 && finding.pair == kNothing;
    if (of_row && finding.row == kNothing) {
        return;
    }
    uint block, first, second;
    if (of_row) {
        uint rows = tile_count * kTile;
        uint row = finding.row % rows;
        block = finding.row / rows;
        first = tile_places[row / kTile].x + row % kTile;
        second = tile_places[row / kTile].y;
    } else {
        uint pair = check_step == 1 ? gl_WorkGroupID.x : finding.pair % pairs;
        block = check_step == 1 ? gl_WorkGroupID.y : finding.pair / pairs;
        first = tile_places[tile_count + pair].x;
        second = tile_places[tile_count + pair].y;
    }
    uint place = look(first, second, of_row ? kTile : 1, block, check_step == 1);
    bool cut = guard_cut();
    place = cut ? min(place, 0) : place;
    // What any_difference.comp saw, and is not there any more.
    uint faults = cut ? kEndlessLoop : finding.row_faults;
    bool gone = of_row && place == kNothing;
    if ((place != kNothing || gone) && gl_LocalInvocationID.x == 0) {
        if (check_step == 1) {
            atomicMin(finding.pair, block * pairs + gl_WorkGroupID.x);
            return;
        }
        describe(first, second, block, gone ? 0 : place);
        if (cut || gone) {
            finding.kind = kFault;
            finding.there = float(faults);
        }
    }
}
