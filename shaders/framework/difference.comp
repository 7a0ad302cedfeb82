#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid -> partial sums of the difference, for each block of voxels and each pair of
// materials that is wanted. A workgroup is one subgroup and takes one block and one tile: kTile
// materials (rows) against kTile materials (columns), with a lane to every few texels. Tiles on the
// diagonal of the matrix of pairs need only the pairs above it: they are dispatched apart.

#include "framework/metric.glsl"
#include "framework/pair_tile.glsl"
#include "framework/texel_difference.glsl"
#include "framework/add_lanes.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                       // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]
layout(std430, binding = 2) readonly buffer TilePlaces { uvec2 tile_places[]; };

layout(push_constant) uniform Push {
    uint padded_materials;  // of the grid: those that fill up the last tile too
    uint materials;
    uint tile_count;
    uint first_tile;  // of this dispatch
};

// Texels are added in runs of kRun, and the runs with Kahan's compensation, so that only the roundings
// within a run count.
const uint kRun = RUN_TEXELS;

void main() {
    uint block = gl_WorkGroupID.y;
    uint tile = first_tile + gl_WorkGroupID.x;
    uvec2 at = tile_places[tile];
    int rows = int((block * padded_materials + at.x) * kBlockTexels);
    int columns = int((block * padded_materials + at.y) * kBlockTexels);

    float total[kPairs];
    float sum[kPairs];  // begins each run with what rounding the total has lost
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        total[i] = 0.0;
        sum[i] = 0.0;
    }
    for (uint first = 0; first < kBlockTexels; first += kRun * gl_WorkGroupSize.x) {
        for (uint step = 0; step < kRun && first + step * gl_WorkGroupSize.x < kBlockTexels; ++step) {
            int texel = int(first + step * gl_WorkGroupSize.x + gl_LocalInvocationID.x);
            vec4 column[kTile];
            [[unroll]] for (uint c = 0; c < kTile; ++c) {
                column[c] = texelFetch(grid, columns + int(c * kBlockTexels) + texel);
            }
            [[unroll]] for (uint r = 0; r < kTile; ++r) {
                vec4 row = column[r];
                if (!kDiagonal) {
                    row = texelFetch(grid, rows + int(r * kBlockTexels) + texel);
                }
                [[unroll]] for (uint c = 0; c < kTile; ++c) {
                    if (is_wanted(r * kTile + c)) {
                        sum[r * kTile + c] += texel_difference(row, column[c]);
                    }
                }
            }
        }
        [[unroll]] for (uint i = 0; i < kPairs; ++i) {
            if (is_wanted(i)) {
                precise float both = total[i] + sum[i];
                precise float lost = sum[i] - (both - total[i]);
                total[i] = both;
                sum[i] = lost;
            }
        }
    }
    uint out_at = (block * tile_count + tile) * kPairs;
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        if (is_wanted(i)) {
            float all = add_lanes(total[i], sum[i]);
            if (gl_LocalInvocationID.x == 0) {  // subgroupElect() loops on lavapipe
                sums[out_at + i] = all;
            }
        }
    }
}
