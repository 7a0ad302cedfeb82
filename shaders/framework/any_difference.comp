#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// What difference.comp does, for a metric without a degree: its difference may be long, so it is there
// once and not unrolled. A workgroup is one subgroup and takes one block and one row of a tile: one
// material against kTile, one after the other.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"
#include "framework/tile.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                       // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]

layout(push_constant) uniform Push {
    uint tiles_across;  // tiles along one side of the triangle of pairs
};

void main() {
    uint block = gl_WorkGroupID.y;
    uint tile = gl_WorkGroupID.x / kTile;
    uint row = gl_WorkGroupID.x % kTile;
    uvec2 at = tile_at(tile, tiles_across);
    uint first = block * tiles_across * kTile;
    int row_texels = int((first + at.x * kTile + row) * kBlockTexels);
    uint tile_count = tiles_across * (tiles_across + 1) / 2;
    uint out_at = ((block * tile_count + tile) * kTile + row) * kTile;
    for (uint column = 0; column < kTile; ++column) {
        int column_texels = int((first + at.y * kTile + column) * kBlockTexels);
        double sum = 0.0;
        for (uint texel = gl_LocalInvocationID.x; texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
            sum += double(texel_difference(texelFetch(grid, row_texels + int(texel)),
                                           texelFetch(grid, column_texels + int(texel))));
        }
        float all = float(subgroupAdd(sum));
        if (subgroupElect()) {
            sums[out_at + column] = all;
        }
    }
}
