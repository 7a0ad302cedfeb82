#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// What difference.comp does, for a metric without a degree: its difference may be long, so it is there
// once and not unrolled. A workgroup is one subgroup and takes one block and one row of a tile: one
// material against kTile, one after the other.
//
// Of a metric that nobody has tested every difference is looked at on the way, and of every fourth voxel of a
// pair, of the next pair another one, that of the two samples the other way round, too.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"
#include "framework/pair_tile.glsl"
#include "framework/add_lanes.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                       // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]
layout(std430, binding = 2) readonly buffer TilePlaces { uvec2 tile_places[]; };

#ifdef GUARDED
#define FINDING_BINDING 3
#include "framework/finding.glsl"
const uint kEvery = 4;
#else
const uint kEvery = 1;
#endif

layout(push_constant) uniform Push {
    uint padded_materials;  // of the grid: those that fill up the last tile too
    uint materials;         // those beyond are not looked at: a metric may be of no use for zeros
    uint tile_count;
    uint first_tile;  // of this dispatch
};

#ifdef GUARDED
// Of the kEvery texels that a lane takes at a time, the one that it also takes the other way round.
uint turned_of(uint first, uint second, uint texel) {
    return (first + second + gl_LocalInvocationID.x + texel / (kEvery * gl_WorkGroupSize.x)) % kEvery;
}

// Positive and finite, or a zero of either sign.
bool is_good(float difference) { return floatBitsToUint(difference) < 0x7f800000u || difference == 0.0; }
#endif

void main() {
    uint block = gl_WorkGroupID.y;
    uint tile = first_tile + gl_WorkGroupID.x / kTile;
    uint row = gl_WorkGroupID.x % kTile;
    uvec2 at = tile_places[tile];
    uint first = block * padded_materials;
    int row_texels = int((first + at.x + row) * kBlockTexels);
    uint out_at = ((block * tile_count + tile) * kTile + row) * kTile;
    bool fine = true;
    for (uint column = 0; column < kTile; ++column) {
        uint second = at.y + column;
        bool wanted = second > at.x + row && second < materials;
        int column_texels = int((first + second) * kBlockTexels);
#ifdef ADDS_FLOAT64
        double sum = 0.0;
#else
        float sum = 0.0;
        float lost = 0.0;
#endif
        for (uint from = gl_LocalInvocationID.x; wanted && from < kBlockTexels; from += kEvery * gl_WorkGroupSize.x) {
#ifdef GUARDED
            uint turned = turned_of(at.x + row, second, from);
            float there = 0.0;
            // One copy of the difference: the last time round it is that of the texel that is turned.
            for (uint i = 0; i <= kEvery; ++i) {
                bool back = i == kEvery;
                int texel = int(from + (back ? turned : i) * gl_WorkGroupSize.x);
                vec4 a = texelFetch(grid, row_texels + texel);
                vec4 b = texelFetch(grid, column_texels + texel);
                float term = 0.0;
                if (a.w != 0.0) {  // what weighs nothing may have no difference
                    float h = difference(back ? b.xyz : a.xyz, back ? a.xyz : b.xyz);
                    bool same = !back || abs(h - there) <= allowed_asymmetry(a.xyz, b.xyz, there, h);
                    fine = fine && is_good(h) && same;
                    there = i == turned ? h : there;
                    term = back ? 0.0 : a.w * h;
                }
#else
            {
                float term = texel_difference(texelFetch(grid, row_texels + int(from)),
                                              texelFetch(grid, column_texels + int(from)));
#endif
#ifdef ADDS_FLOAT64
                sum += double(term);
#else  // with Kahan's compensation
                precise float more = lost + term;
                precise float both = sum + more;
                precise float rest = more - (both - sum);
                sum = both;
                lost = rest;
#endif
            }
        }
#ifdef ADDS_FLOAT64
        float all = add_lanes(sum);
#else
        float all = add_lanes(sum, lost);
#endif
        if (gl_LocalInvocationID.x == 0) {
            sums[out_at + column] = all;
        }
    }
#ifdef GUARDED
    guard_cut();
    if (guard_faults != 0) {
        atomicOr(finding.row_faults, guard_faults);
        fine = false;
    }
    if (!fine) {
        atomicMin(finding.row, (block * tile_count + first_tile) * kTile + gl_WorkGroupID.x);
    }
#endif
}
