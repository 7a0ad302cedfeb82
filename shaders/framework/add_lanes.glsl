// The sum of what the lanes of a workgroup have: of each a number that is not negative, and what its
// roundings have lost. Rounded once, and by an eighth of a rounding more where float64 is slow or
// missing (docs/numerics.md).

// Without being told, a device may round what is beyond float32 to the largest number there is, where it
// stays however much is added.
float largest_as_infinite(float sum) {
#ifdef ROUNDS_TO_NEAREST
    return sum;
#else
    return sum >= uintBitsToFloat(0x7f7fffffu) ? uintBitsToFloat(0x7f800000u) : sum;
#endif
}

#ifdef ADDS_FLOAT64
float add_lanes(double sum) { return largest_as_infinite(float(subgroupAdd(sum))); }

float add_lanes(float total, float lost) { return add_lanes(double(total) + double(lost)); }
#else
// In two sums (Demmel and Nguyen 2013): of multiples of a quantum that is so coarse that no order of
// adding them rounds, and of the rest, which is small.
float add_lanes(float total, float lost) {
    float most = subgroupMax(total);
    uint exponent = floatBitsToUint(most) & 0x7f800000u;
    if (exponent == 0x7f800000u) {
        return most;
    }
    // Of large numbers the sum may be beyond float32 before the rest is subtracted.
    float down = most > 1e30 ? 5.9604645e-8 : 1.0;  // 2^-24
    float up = most > 1e30 ? 16777216.0 : 1.0;
    // The last bit of a number of this size is the quantum, and the lanes' sum is below 2^24 of them.
    float size = uintBitsToFloat(exponent) * down * float(gl_SubgroupSize);
    precise float scaled = total * down;
    precise float both = scaled + size;
    precise float high = both - size;
    precise float low = (scaled - high) + lost * down;
    precise float sum = subgroupAdd(high) + subgroupAdd(low);
    return largest_as_infinite(sum * up);
}
#endif
