#version 460
#extension GL_GOOGLE_include_directive : require

// The weights of a window in a block -> the part of the block beyond which all are zero, which is all that
// window_sums.comp looks at; and the first weight that is none. One invocation takes one window in one block.

layout(local_size_x_id = 0) in;

layout(binding = 0) uniform usamplerBuffer weights;                   // float64 [block][window][voxel]
layout(std430, binding = 1) writeonly buffer Parts { uvec4 parts[]; };  // [block][window]

layout(push_constant) uniform Push {
    uint count;  // windows in blocks
};

void main() {
    uint at = gl_GlobalInvocationID.x;
    if (at >= count) {
        return;
    }
    uint first = BLOCK_VOXELS;
    uint last = 0;
    uint bad = BLOCK_VOXELS;
    uint bad_bits = 0;
    for (uint k = 0; k < BLOCK_VOXELS; k += 2) {
        uvec4 two = texelFetch(weights, int((at * BLOCK_VOXELS + k) / 2));
        for (uint i = 0; i < 2; ++i) {
            uvec2 words = i == 0 ? two.xy : two.zw;
            bool is_zero = (words.y & 0x7fffffffu) == 0 && words.x == 0;
            first = is_zero ? first : min(first, k + i);
            last = is_zero ? last : k + i + 1;
            // Positive and finite, or a zero of either sign.
            if (bad == BLOCK_VOXELS && !is_zero && words.y >= 0x7ff00000u) {
                bad = k + i;
                bad_bits = floatBitsToUint(float(packDouble2x32(words)));
            }
        }
    }
    first = first / WINDOW_LANES * WINDOW_LANES;
    last = (last + WINDOW_LANES - 1) / WINDOW_LANES * WINDOW_LANES;
    parts[at] = uvec4(min(first, last), last, bad, bad_bits);
}
