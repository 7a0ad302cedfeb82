// The voxels of a slab as the host made them: eight float64 numbers and four integers each, in five texels
// of words.

layout(binding = 0) uniform usamplerBuffer geometry;

dvec2 two_doubles(uvec4 words) { return dvec2(packDouble2x32(words.xy), packDouble2x32(words.zw)); }

Voxel fetch_voxel(uint k) {
    dvec2 a = two_doubles(texelFetch(geometry, int(5 * k)));
    dvec2 b = two_doubles(texelFetch(geometry, int(5 * k + 1)));
    dvec2 c = two_doubles(texelFetch(geometry, int(5 * k + 2)));
    dvec2 d = two_doubles(texelFetch(geometry, int(5 * k + 3)));
    ivec4 layers = ivec4(texelFetch(geometry, int(5 * k + 4)));
    return Voxel(a.x, a.y, b.x, b.y, c.x, c.y, d.x, d.y, layers.x, layers.y, layers.z, layers.w);
}
