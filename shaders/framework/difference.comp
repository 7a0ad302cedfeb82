#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// A metric's grid -> partial sums of the difference, for each block of voxels and each pair of
// materials. A workgroup is one subgroup and takes one block and one tile: kTile materials (rows)
// against kTile materials (columns), with a lane to every few texels.

#include "framework/metric.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                       // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]

layout(push_constant) uniform Push {
    uint tiles_across;  // tiles along one side of the triangle of pairs
};

const uint kTile = 10;  // the host knows the same number

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

    float sum[kTile * kTile];
    [[unroll]] for (uint i = 0; i < kTile * kTile; ++i) {
        sum[i] = 0.0;
    }
    for (uint texel = gl_LocalInvocationID.x; texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
        vec4 column[kTile];
        [[unroll]] for (uint c = 0; c < kTile; ++c) {
            column[c] = texelFetch(grid, columns + int(c * kBlockTexels + texel));
        }
        [[unroll]] for (uint r = 0; r < kTile; ++r) {
            vec4 row = texelFetch(grid, rows + int(r * kBlockTexels + texel));
            [[unroll]] for (uint c = 0; c < kTile; ++c) {
                sum[r * kTile + c] += texel_difference(row, column[c]);
            }
        }
    }
    uint tile_count = tiles_across * (tiles_across + 1) / 2;
    uint out_at = (block * tile_count + tile) * kTile * kTile;
    [[unroll]] for (uint i = 0; i < kTile * kTile; ++i) {
        float total = subgroupAdd(sum[i]);
        if (subgroupElect()) {
            sums[out_at + i] = total;
        }
    }
}
