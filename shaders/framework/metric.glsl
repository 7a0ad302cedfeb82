// What a metric file sees, and what the kernels need to know of it. "chosen_metric.glsl" is a
// generated file that includes one metric.
//
// Transforms and weights run in float64 (the including file defines METRIC_FLOAT64) and are rounded
// once, when they enter the grid; differences run in float32 on the grid. The metric file says float
// for both, as it does when it is compiled as C++ in float64.

#include "lib/numerics.glsl"

#ifdef METRIC_FLOAT64
#include "lib/float64.glsl"
#define float double
#define vec2 dvec2
#define vec3 dvec3
#define vec4 dvec4
#define mat3 dmat3
#endif

struct Voxel {
    float theta_h;  // half-difference angles of the voxel's centre, radians
    float theta_d;
    float phi_d;
    float s_merl;  // MERL scale factor
    float cos_theta_i;
    float cos_theta_o;
    float solid_angle;  // of its pairs of directions, sr^2: 4 pi s_merl / voxels
    float voxels;       // of the whole grid, also those below the horizon
};

#ifdef COUNTED_LOOPS
// The conditions of the metric's loops call this. One invocation gets so many iterations, and then its
// loops just end: on lavapipe all would end so, in silence, after twice as many.
const uint kMostLoops = 32768;
uint loops_ = 0;
bool count_loop_() { return ++loops_ <= kMostLoops; }
bool loops_ran_out() { return loops_ > kMostLoops; }
#endif

#include "chosen_metric.glsl"

#ifdef METRIC_FLOAT64
#undef float
#undef vec2
#undef vec3
#undef vec4
#undef mat3
#endif

// Partial sums run over blocks of voxels; a cell is four voxels. The host knows the same numbers.
const uint kBlockVoxels = 1024;
const uint kCellVoxels = 4;

// Two ways to lay out a block of a metric's grid, one rgba32f texel at a time.
#ifdef DEGREE_NUMERATOR
// The difference is a sum over channels of a homogeneous function of one channel's difference: the
// weight moves into the samples, and a texel is one channel of a cell. A block is its red cells, then
// its green and its blue ones. A chunk is four consecutive cells of a channel.
const uint kCellTexels = 3;
const uint kChunkTexels = 4;
uint channel_texel(uint channel, uint cell) { return channel * (kBlockVoxels / kCellVoxels) + cell; }
uint channel_of_texel(uint texel) { return texel / (kBlockVoxels / kCellVoxels); }
uint cell_of_texel(uint texel) { return texel % (kBlockVoxels / kCellVoxels); }
#else
// Any difference: a texel is one voxel's transformed sample and its weight.
const uint kCellTexels = 4;
#endif
const uint kBlockTexels = kBlockVoxels / kCellVoxels * kCellTexels;
