// What a metric file sees, and what the kernels need to know of it. The metric itself comes after the
// last line of a kernel (engine/metric/metric_kernels.cpp): so nothing in it can change what is here.
//
// Transforms and weights run in float64 (the including file defines METRIC_FLOAT64) and are rounded
// once, when they enter the grid; differences run in float32 on the grid. The metric file says float
// for both, as it does when it is compiled as C++ in float64.

#include "lib/numerics.glsl"

#ifdef METRIC_FLOAT64
#include "lib/float64.glsl"
#include "framework/float64_names.glsl"
#endif

struct Voxel {
    float theta_h;  // half-difference angles of the voxel's centre, radians
    float theta_d;
    float phi_d;    // below pi: beyond it a voxel is described by the one at phi_d - pi
    float s_merl;  // MERL scale factor
    float cos_theta_i;
    float cos_theta_o;
    float solid_angle;  // of its pairs of directions, sr^2: 4 pi s_merl / voxels
    float voxels;       // of the whole grid over pi, also those below the horizon
    int theta_h_layer;  // of the grid, from 0, and how many there are
    int theta_h_layers;
    int theta_d_layer;
    int theta_d_layers;
};

#ifdef WINDOWS
// A summary: its windows, and what it makes of the means over each.
struct Means {
    vec3 rgb[WINDOWS];
};

float window(int w, Voxel v);
float feature(int i, Means m);
#else
vec3 transform(vec3 f, Voxel v);
float weight(Voxel v);
#ifdef DEGREE_NUMERATOR
float difference(float d);
#else
float difference(vec3 a, vec3 b);
#endif
#endif

#ifdef METRIC_FLOAT64
#undef float
#undef vec2
#undef vec3
#undef vec4
#undef mat2
#undef mat3
#undef mat4
#endif

#ifdef GUARDED
#include "framework/guards.glsl"
#endif

// Partial sums run over blocks of voxels; a cell is four voxels. The numbers are those of
// engine/metric/metric.h.
const uint kBlockVoxels = BLOCK_VOXELS;
const uint kCellVoxels = CELL_VOXELS;

// Two ways to lay out a block of a metric's grid, one rgba32f texel at a time.
#ifdef DEGREE_NUMERATOR
// The difference is a sum over channels of a homogeneous function of one channel's difference: the
// weight moves into the samples, and a texel is one channel of a cell. A block is its red cells, then
// its green and its blue ones. A chunk is four consecutive cells of a channel.
const uint kCellTexels = 3;
const uint kChunkTexels = CHUNK_TEXELS;
uint channel_texel(uint channel, uint cell) { return channel * (kBlockVoxels / kCellVoxels) + cell; }
uint channel_of_texel(uint texel) { return texel / (kBlockVoxels / kCellVoxels); }
uint cell_of_texel(uint texel) { return texel % (kBlockVoxels / kCellVoxels); }
#else
// Any difference: a texel is one voxel's transformed sample and its weight.
const uint kCellTexels = 4;
#endif
const uint kBlockTexels = kBlockVoxels / kCellVoxels * kCellTexels;
