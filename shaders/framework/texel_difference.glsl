// The difference of two texels of a metric's grid.

#ifdef DEGREE_NUMERATOR
float texel_difference(vec4 a, vec4 b) {
    return (difference(a.x - b.x) + difference(a.y - b.y)) +
           (difference(a.z - b.z) + difference(a.w - b.w));
}
#else
float texel_difference(vec4 a, vec4 b) { return a.w * difference(a.xyz, b.xyz); }
#endif
