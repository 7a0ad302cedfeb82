#version 460
#extension GL_GOOGLE_include_directive : require

// Samples and windows of a slab -> for each block, material and window the sums of weight times sample and
// of weights, of each channel where it was measured. A workgroup takes one block of one material. Sums have
// one order on every device, which is that of the host (engine/distance/host/summary_metric.cpp): lanes,
// each over every WINDOW_LANES-th voxel, and then each with the one half as many further on.

layout(local_size_x_id = 0) in;  // WINDOW_LANES

layout(binding = 0) uniform usamplerBuffer samples;  // float64 [material][block][channel][voxel]
layout(binding = 1) uniform usamplerBuffer weights;  // float64 [block][window][voxel]
layout(binding = 2) uniform usamplerBuffer parts;    // [block][window]
layout(std430, binding = 3) writeonly buffer Sums { double sums[]; };  // [block][material][window][6]

layout(push_constant) uniform Push {
    uint slab_blocks;  // blocks between two materials
    uint materials;
};

shared double lanes[6][WINDOW_LANES];

uvec2 words_at(usamplerBuffer from, uint at) {
    uvec4 two = texelFetch(from, int(at / 2));
    return at % 2 == 0 ? two.xy : two.zw;
}

void main() {
    uint material = gl_WorkGroupID.x;
    uint block = gl_WorkGroupID.y;
    uint lane = gl_LocalInvocationID.x;
    uint of_block = (material * slab_blocks + block) * 3 * BLOCK_VOXELS;
    for (uint w = 0; w < WINDOWS; ++w) {
        uint window = block * WINDOWS + w;
        uvec2 part = texelFetch(parts, int(window)).xy;
        if (part.x == part.y) {
            continue;  // nobody reads the sums
        }
        double sum[6] = double[6](0.0lf, 0.0lf, 0.0lf, 0.0lf, 0.0lf, 0.0lf);
        for (uint k = part.x + lane; k < part.y; k += WINDOW_LANES) {
            double weight = packDouble2x32(words_at(weights, window * BLOCK_VOXELS + k));
            for (uint c = 0; c < 3; ++c) {
                uvec2 words = words_at(samples, of_block + c * BLOCK_VOXELS + k);
                // The sign says that it was not measured (vulkan_engine.cpp).
                bool is_measured = words.y < 0x80000000u;
                precise double product = is_measured ? weight * packDouble2x32(words) : 0.0lf;
                precise double more = sum[c] + product;
                precise double more_weight = sum[3 + c] + (is_measured ? weight : 0.0lf);
                sum[c] = more;
                sum[3 + c] = more_weight;
            }
        }
        for (uint i = 0; i < 6; ++i) {
            lanes[i][lane] = sum[i];
        }
        barrier();
        if (lane < 6) {
            for (uint half_lanes = WINDOW_LANES / 2; half_lanes > 0; half_lanes /= 2) {
                for (uint i = 0; i < half_lanes; ++i) {
                    lanes[lane][i] += lanes[lane][i + half_lanes];
                }
            }
            sums[((block * materials + material) * WINDOWS + w) * 6 + lane] = lanes[lane][0];
        }
        barrier();
    }
}
