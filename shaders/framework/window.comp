#version 460
#extension GL_GOOGLE_include_directive : require

// Voxels of a slab -> the weight of each in each window of a summary metric. A workgroup takes some voxels
// of one window.

#define METRIC_FLOAT64
#include "framework/metric.glsl"
#include "framework/geometry.glsl"

layout(local_size_x_id = 0) in;

layout(std430, binding = 1) writeonly buffer Weights { double weights[]; };  // [block][window][voxel]

layout(push_constant) uniform Push {
    uint voxel_count;  // voxels of this slab; the last block is filled up with zeros
};

void main() {
    uint k = gl_GlobalInvocationID.x;
    uint w = gl_WorkGroupID.y;
    double result = k < voxel_count ? window(int(w), fetch_voxel(k)) : 0.0;
#ifdef GUARDED
    result = guard_cut() || guard_faults != 0 ? nan64() : result;
#endif
    weights[(k / kBlockVoxels * WINDOWS + w) * kBlockVoxels + k % kBlockVoxels] = result;
}
