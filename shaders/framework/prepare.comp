#version 460
#extension GL_GOOGLE_include_directive : require

// samples of a slab -> a metric's grid: transformed samples with their weight, in texels.
// One invocation makes one cell (see metric.glsl) of one material.

#include "framework/metric.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 0) readonly buffer Samples { float samples[]; };  // [material][channel][voxel]
layout(std430, binding = 1) readonly buffer Voxels { vec4 voxels[]; };     // two per voxel
layout(std430, binding = 2) writeonly buffer Grid { vec4 grid[]; };        // [block][material][texel]

layout(push_constant) uniform Push {
    uint stride;            // voxels between two planes of samples
    uint voxel_count;       // voxels of this slab; the last block is filled with zeros
    uint materials;         // materials of the database
    uint padded_materials;  // materials of the grid; those beyond the database's are zero
};

vec4 weighted_sample(uint material, uint k) {
    if (k >= voxel_count || material >= materials) {
        return vec4(0.0);
    }
    vec4 v0 = voxels[2 * k];
    vec4 v1 = voxels[2 * k + 1];
    Voxel v = Voxel(v0.x, v0.y, v0.z, v1.x, v1.y, v0.w);
    uint at = material * 3 * stride + k;
    vec3 t = transform(vec3(samples[at], samples[at + stride], samples[at + 2 * stride]), v);
#ifdef DEGREE_NUMERATOR
    return vec4(folded(weight(v)) * t, 0.0);
#else
    return vec4(t, weight(v));
#endif
}

void main() {
    uint cell = gl_GlobalInvocationID.x;
    uint material = gl_GlobalInvocationID.y;
    uint k = cell * kVoxelsPerCell;
    uint block = k / kBlockVoxels;
    uint texel = cell * kTexelsPerCell - block * kBlockTexels;
    uint at = (block * padded_materials + material) * kBlockTexels + texel;
#ifdef DEGREE_NUMERATOR
    vec4 a = weighted_sample(material, k);
    vec4 b = weighted_sample(material, k + 1);
    vec4 c = weighted_sample(material, k + 2);
    vec4 d = weighted_sample(material, k + 3);
    grid[at] = vec4(a.xyz, b.x);
    grid[at + 1] = vec4(b.yz, c.xy);
    grid[at + 2] = vec4(c.z, d.xyz);
#else
    grid[at] = weighted_sample(material, k);
#endif
}
