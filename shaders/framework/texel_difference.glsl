// The difference of two texels of a metric's grid.

#ifdef DEGREE_NUMERATOR
// A metric that declares a degree has the difference |d|^degree, as degree.comp and check.comp see to. Four at a time:
// a compiler that keeps this order has four independent chains of operations to interleave.
vec4 difference(vec4 d) {
#if DEGREE_NUMERATOR < DEGREE_DENOMINATOR
    return two_thirds_power(d);
#elif DEGREE_NUMERATOR == 1
    return abs(d);
#else
    return d * d;
#endif
}

float texel_difference(vec4 a, vec4 b) {
    vec4 h = difference(a - b);
    return (h.x + h.y) + (h.z + h.w);
}
#else
// What weighs nothing, as what is beyond the last voxel, may have no difference.
float texel_difference(vec4 a, vec4 b) { return a.w == 0.0 ? 0.0 : a.w * difference(a.xyz, b.xyz); }
#endif
