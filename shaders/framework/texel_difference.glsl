// The difference of two texels of a metric's grid, and for a degree below one what bounds its error.

#ifdef DEGREE_NUMERATOR
float texel_difference(vec4 a, vec4 b) {
    return (difference(a.x - b.x) + difference(a.y - b.y)) +
           (difference(a.z - b.z) + difference(a.w - b.w));
}
#else
float texel_difference(vec4 a, vec4 b) { return a.w * difference(a.xyz, b.xyz); }
#endif

#if defined(DEGREE_NUMERATOR) && DEGREE_NUMERATOR < DEGREE_DENOMINATOR
// A power below one is steep near zero: an error e of d changes |d|^p by up to about |d|^(p-1) e. So
// the error is summed beside the difference, from the largest sample and the steepest slope of the
// four scalars (docs/numerics.md).
#define ERROR_SUMS
#if DEGREE_NUMERATOR != 2 || DEGREE_DENOMINATOR != 3
#error "degree: below one only 2/3 is supported"
#endif

float largest(vec4 v) { return max(max(v.x, v.y), max(v.z, v.w)); }

// Within 4 % of 0.86 |d|^(-1/3) for the smallest of the four: the seed that the power starts from,
// whose bits are there already. Integers, because their minimum is one instruction.
float texel_slope(vec4 a, vec4 b) {
    vec4 d = abs(a - b);
    int least = min(min(third_of_bits(d.x), third_of_bits(d.y)),
                    min(third_of_bits(d.z), third_of_bits(d.w)));
    return intBitsToFloat(kTwoThirdsSeed - least);
}
#endif
