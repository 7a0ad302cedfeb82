#version 460
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require

// Ranges of chunks -> for each block and each pair of materials what bounds the error that the rounding
// of samples makes under a power below one (docs/numerics.md): the sum over chunks of size / gap^(1/3),
// where size is the largest |a| + |b| of the chunk and no |a - b| of it is below the gap. A workgroup
// is one subgroup and takes one block and one tile, as in difference.comp.

#include "framework/metric.glsl"
#include "framework/pair_tile.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform samplerBuffer ranges;                     // [block][material][chunk/2]
layout(std430, binding = 1) writeonly buffer Sums { float sums[]; };  // [block][tile][row][column]
layout(std430, binding = 2) readonly buffer TilePlaces { uvec2 tile_places[]; };

layout(push_constant) uniform Push {
    uint padded_materials;  // of the grid: those that fill up the last tile too
    uint materials;
    uint tile_count;
    uint first_tile;  // of this dispatch
};

const uint kTexels = kBlockTexels / kChunkTexels / 2;  // of one block and material

// Of two chunks: a and b are their smallest and largest numbers, one chunk in xy and one in zw.
float slopes(vec4 a, vec4 b, vec2 size_of_a, vec2 size_of_b) {
    vec2 size = size_of_a + size_of_b;
    vec2 gap = max(max(a.xz - b.yw, b.xz - a.yw), size * 5.9604645e-8);  // 2^-24: no less is resolved
    vec2 slope = size * vec2(inverse_cube_root_seed(gap.x), inverse_cube_root_seed(gap.y));
    return slope.x + slope.y;
}

void main() {
    uint block = gl_WorkGroupID.y;
    uint tile = first_tile + gl_WorkGroupID.x;
    uvec2 at = tile_places[tile];
    int rows = int((block * padded_materials + at.x) * kTexels);
    int columns = int((block * padded_materials + at.y) * kTexels);

    float sum[kPairs];
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        sum[i] = 0.0;
    }
    for (uint texel = gl_LocalInvocationID.x; texel < kTexels; texel += gl_WorkGroupSize.x) {
        vec4 column[kTile];
        vec2 column_size[kTile];
        [[unroll]] for (uint c = 0; c < kTile; ++c) {
            column[c] = texelFetch(ranges, columns + int(c * kTexels + texel));
            column_size[c] = max(abs(column[c].xz), abs(column[c].yw));
        }
        [[unroll]] for (uint r = 0; r < kTile; ++r) {
            vec4 row = texelFetch(ranges, rows + int(r * kTexels + texel));
            vec2 row_size = max(abs(row.xz), abs(row.yw));
            [[unroll]] for (uint c = 0; c < kTile; ++c) {
                if (is_wanted(r * kTile + c)) {
                    sum[r * kTile + c] += slopes(row, column[c], row_size, column_size[c]);
                }
            }
        }
    }
    uint out_at = (block * tile_count + tile) * kPairs;
    [[unroll]] for (uint i = 0; i < kPairs; ++i) {
        if (is_wanted(i)) {
            float all = subgroupAdd(sum[i]);
            if (gl_LocalInvocationID.x == 0) {
                sums[out_at + i] = all;
            }
        }
    }
}
