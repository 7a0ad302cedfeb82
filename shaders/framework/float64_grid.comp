#version 460
#extension GL_GOOGLE_include_directive : require

// Samples of a slab -> transformed samples, all in float64 and without their weights: what refines a user's
// metric with a degree (engine/distance/vulkan/vulkan_float64.h). One invocation takes two voxels of one
// material.

#define METRIC_FLOAT64
#include "framework/metric.glsl"
#include "framework/geometry.glsl"

layout(local_size_x_id = 0) in;

layout(binding = 1) uniform usamplerBuffer samples;  // float64 [material][block][channel][voxel]
layout(std430, binding = 2) writeonly buffer Grid { dvec2 grid[]; };  // likewise, two voxels at a time

layout(push_constant) uniform Push {
    double scale;  // a power of two that what is transformed is multiplied with
    uint slab_blocks;  // blocks between two materials
    uint voxel_count;  // voxels of this slab; the last block is filled up with zeros
};

void main() {
    uint k = 2 * gl_GlobalInvocationID.x;
    uint block = k / kBlockVoxels;
    uint at = ((gl_WorkGroupID.y * slab_blocks + block) * 3 * kBlockVoxels + k % kBlockVoxels) / 2;
    const uint channel = kBlockVoxels / 2;
    dvec2 red = two_doubles(texelFetch(samples, int(at)));
    dvec2 green = two_doubles(texelFetch(samples, int(at + channel)));
    dvec2 blue = two_doubles(texelFetch(samples, int(at + 2 * channel)));
    dvec3 t0 = transform(dvec3(red.x, green.x, blue.x), fetch_voxel(k));
    dvec3 t1 = transform(dvec3(red.y, green.y, blue.y), fetch_voxel(k + 1));
#ifdef GUARDED
    if (guard_cut() || guard_faults != 0) {
        t0 = dvec3(nan64());
    }
#endif
    // Beyond the last voxel a transform may make NaN of geometry that is not there.
    t0 = k < voxel_count ? t0 * scale : dvec3(0.0);
    t1 = k + 1 < voxel_count ? t1 * scale : dvec3(0.0);
    grid[at] = dvec2(t0.x, t1.x);
    grid[at + channel] = dvec2(t0.y, t1.y);
    grid[at + 2 * channel] = dvec2(t0.z, t1.z);
}
