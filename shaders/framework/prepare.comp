#version 460
#extension GL_GOOGLE_include_directive : require

// Samples of a slab -> a metric's grid: transformed samples and their weights, rounded to float32.
// One invocation makes one cell of one material. On lavapipe texel fetches are vectorised, and loads
// from storage buffers are not.

#define METRIC_FLOAT64
#include "framework/metric.glsl"
#include "framework/geometry.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 1) uniform usamplerBuffer samples;                    // [material][block][channel][voxel]
layout(binding = 2) uniform usamplerBuffer weights;                    // per voxel
layout(std430, binding = 3) writeonly buffer Grid { vec4 grid[]; };    // [block][material][texel]

layout(push_constant) uniform Push {
    uint slab_blocks;       // blocks between two materials
    uint materials;         // materials of the database
    uint padded_materials;  // materials of the grid; those beyond the database's are zero
    uint voxel_count;       // voxels of this slab; the last block is filled up with zeros
};

// Four consecutive float64 numbers, the first at a multiple of four.
dvec4 four_doubles(usamplerBuffer from, uint at) {
    return dvec4(two_doubles(texelFetch(from, int(at / 2))), two_doubles(texelFetch(from, int(at / 2 + 1))));
}

// Likewise samples, which are not negative: what was not measured may be a zero with a sign, which only
// window_sums.comp looks at.
dvec4 four_samples(uint at) {
    const uvec4 without_sign = uvec4(0xffffffffu, 0x7fffffffu, 0xffffffffu, 0x7fffffffu);
    return dvec4(two_doubles(texelFetch(samples, int(at / 2)) & without_sign),
                 two_doubles(texelFetch(samples, int(at / 2 + 1)) & without_sign));
}

void main() {
    uint cell = gl_GlobalInvocationID.x;
    uint material = gl_GlobalInvocationID.y;
    uint k = cell * kCellVoxels;
    uint block = k / kBlockVoxels;
    cell -= block * (kBlockVoxels / kCellVoxels);
    uint at = (block * padded_materials + material) * kBlockTexels;
    if (material >= materials) {
        for (uint i = 0; i < kCellTexels; ++i) {
            grid[at + cell * kCellTexels + i] = vec4(0.0);
        }
        return;
    }
    uint from = (material * slab_blocks + block) * 3 * kBlockVoxels + cell * kCellVoxels;
    dvec4 red = four_samples(from);
    dvec4 green = four_samples(from + kBlockVoxels);
    dvec4 blue = four_samples(from + 2 * kBlockVoxels);
    dvec4 weight = four_doubles(weights, k);
    dvec3 t0 = transform(dvec3(red.x, green.x, blue.x), fetch_voxel(k));
    dvec3 t1 = transform(dvec3(red.y, green.y, blue.y), fetch_voxel(k + 1));
    dvec3 t2 = transform(dvec3(red.z, green.z, blue.z), fetch_voxel(k + 2));
    dvec3 t3 = transform(dvec3(red.w, green.w, blue.w), fetch_voxel(k + 3));
#ifdef GUARDED
    if (guard_cut() || guard_faults != 0) {
        t0 = dvec3(nan64());
    }
#endif
    // Beyond the last voxel a transform may make NaN of geometry that is not there.
    t0 = k < voxel_count ? t0 : dvec3(0.0);
    t1 = k + 1 < voxel_count ? t1 : dvec3(0.0);
    t2 = k + 2 < voxel_count ? t2 : dvec3(0.0);
    t3 = k + 3 < voxel_count ? t3 : dvec3(0.0);
#ifdef DEGREE_NUMERATOR
    grid[at + channel_texel(0, cell)] = vec4(dvec4(t0.x, t1.x, t2.x, t3.x) * weight);
    grid[at + channel_texel(1, cell)] = vec4(dvec4(t0.y, t1.y, t2.y, t3.y) * weight);
    grid[at + channel_texel(2, cell)] = vec4(dvec4(t0.z, t1.z, t2.z, t3.z) * weight);
#else
    at += cell * kCellTexels;
    grid[at] = vec4(dvec4(t0, weight.x));
    grid[at + 1] = vec4(dvec4(t1, weight.y));
    grid[at + 2] = vec4(dvec4(t2, weight.z));
    grid[at + 3] = vec4(dvec4(t3, weight.w));
#endif
}
