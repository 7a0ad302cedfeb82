#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// What difference.comp does, for a metric without a degree: its difference may be long, so it is there
// once and not unrolled. A workgroup is one subgroup and takes one block and one row of a tile: one
// material against kTile, one after the other.

#include "framework/metric.glsl"
#include "framework/texel_difference.glsl"
#include "framework/pair_tile.glsl"
#include "framework/add_lanes.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer grid;                       // [block][material][texel]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]
layout(std430, binding = 2) readonly buffer TilePlaces { uvec2 tile_places[]; };

layout(push_constant) uniform Push {
    uint padded_materials;  // of the grid: those that fill up the last tile too
    uint materials;         // those beyond are not looked at: a metric may be of no use for zeros
    uint tile_count;
    uint first_tile;  // of this dispatch
};

void main() {
    uint block = gl_WorkGroupID.y;
    uint tile = first_tile + gl_WorkGroupID.x / kTile;
    uint row = gl_WorkGroupID.x % kTile;
    uvec2 at = tile_places[tile];
    uint first = block * padded_materials;
    int row_texels = int((first + at.x + row) * kBlockTexels);
    uint out_at = ((block * tile_count + tile) * kTile + row) * kTile;
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
        for (uint texel = gl_LocalInvocationID.x; wanted && texel < kBlockTexels; texel += gl_WorkGroupSize.x) {
            float term = texel_difference(texelFetch(grid, row_texels + int(texel)),
                                          texelFetch(grid, column_texels + int(texel)));
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
#ifdef ADDS_FLOAT64
        float all = add_lanes(sum);
#else
        float all = add_lanes(sum, lost);
#endif
        if (gl_LocalInvocationID.x == 0) {
            sums[out_at + column] = all;
        }
    }
}
