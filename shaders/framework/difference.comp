#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid -> partial sums of the difference, for each block of voxels and each pair of
// materials. A workgroup is one subgroup and takes one block and one tile: kTile materials (rows)
// against kTile materials (columns), with a lane to every few texels.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                       // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]
#ifdef ERROR_SUMS
layout(std430, binding = 2) writeonly buffer Errors { float errors[]; };  // likewise
#endif

layout(push_constant) uniform Push {
    uint tiles_across;  // tiles along one side of the triangle of pairs
};

// The host knows the same numbers. Texels are added in runs, and the roundings of adding up the runs
// are kept (Knuth's two-sum) and added in the end, so that only those within a run count.
const uint kPairs = kTile * kTile;
const uint kRun = 8;

void main() {
    uint block = gl_WorkGroupID.y;
    uint tile = gl_WorkGroupID.x;
    uint row_tile = 0;
    uint in_row = tiles_across;  // tiles in this row of the triangle
    uint rest = tile;
    while (rest >= in_row) {
        rest -= in_row;
        --in_row;
        ++row_tile;
    }
    uint column_tile = row_tile + rest;

    uint padded_materials = tiles_across * kTile;
    int rows = int((block * padded_materials + row_tile * kTile) * kBlockTexels);
    int columns = int((block * padded_materials + column_tile * kTile) * kBlockTexels);

    float total[kPairs];
    float lost[kPairs];
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        total[i] = 0.0;
        lost[i] = 0.0;
    }
#ifdef ERROR_SUMS
    float error[kPairs];
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        error[i] = 0.0;
    }
#endif
    uint texel = gl_LocalInvocationID.x;
    while (texel < kBlockTexels) {
        float sum[kPairs];
        [[unroll]] for (uint i = 0; i < kPairs; ++i) {
            sum[i] = 0.0;
        }
        for (uint step = 0; step < kRun && texel < kBlockTexels; ++step, texel += gl_WorkGroupSize.x) {
            vec4 column[kTile];
#ifdef ERROR_SUMS
            float column_size[kTile];
#endif
            [[unroll]] for (uint c = 0; c < kTile; ++c) {
                column[c] = texelFetch(grid, columns + int(c * kBlockTexels + texel));
#ifdef ERROR_SUMS
                column_size[c] = largest(abs(column[c]));
#endif
            }
            [[unroll]] for (uint r = 0; r < kTile; ++r) {
                vec4 row = texelFetch(grid, rows + int(r * kBlockTexels + texel));
#ifdef ERROR_SUMS
                float row_size = largest(abs(row));
#endif
                [[unroll]] for (uint c = 0; c < kTile; ++c) {
                    sum[r * kTile + c] += texel_difference(row, column[c]);
#ifdef ERROR_SUMS
                    error[r * kTile + c] +=
                        (row_size + column_size[c]) * texel_slope(row, column[c]);
#endif
                }
            }
        }
        [[unroll]] for (uint i = 0; i < kPairs; ++i) {
            precise float old = total[i];
            precise float both = old + sum[i];
            precise float part = both - old;
            precise float rest = (old - (both - part)) + (sum[i] - part);
            total[i] = both;
            lost[i] += rest;
        }
    }
    uint tile_count = tiles_across * (tiles_across + 1) / 2;
    uint out_at = (block * tile_count + tile) * kPairs;
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        float all = float(subgroupAdd(double(total[i]) + double(lost[i])));
#ifdef ERROR_SUMS
        float all_errors = subgroupAdd(error[i]);
#endif
        if (subgroupElect()) {
            sums[out_at + i] = all;
#ifdef ERROR_SUMS
            errors[out_at + i] = all_errors;
#endif
        }
    }
}
