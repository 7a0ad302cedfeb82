// What the kernels write down that look for what is wrong with a metric that nobody has tested: check.comp,
// degree.comp and any_difference.comp, which say before they include this which binding it has. The host
// has the same (engine/metric/check/finding.h).

layout(std430, binding = FINDING_BINDING) buffer Finding {
    uint pair;        // of check.comp, the first that is wrong: a workgroup
    uint row;         // of any_difference.comp, likewise,
    uint row_faults;  // and what its rows did on the way (guards.glsl)
    uint number;      // of degree.comp, the first that is wrong
    uint kind;
    uint first;  // materials; kNothing of what does not depend on them
    uint second;
    uint voxel;    // of the slab
    uint channel;  // of the three, for a metric with a degree
    float a[3];    // transformed samples; for a metric with a degree one scalar, weighted
    float b[3];
    float there;  // difference(a, b) and difference(b, a)
    float back;
    float weight;
    // The first voxel at which the difference of a sample from itself is not zero, for a metric without a
    // degree; a material, and the difference.
    uint same_voxel;
    uint same_material;
    float same_difference;
}
finding;

const uint kNothing = 0xffffffffu;

const uint kFine = 0, kWeight = 1, kFirst = 2, kSecond = 3, kNotFinite = 4, kNegative = 5, kAsymmetric = 6,
           kDegree = 7, kFault = 8;

bool is_finite(float x) { return (floatBitsToUint(x) & 0x7f800000u) != 0x7f800000u; }

// Whether a difference went wrong on the way, for which there is no number; `faults` says how.
bool is_faulty(inout float faults) {
    if (guard_faults != 0) {
        faults = float(guard_faults);
        return true;
    }
    return false;
}

#ifdef DEGREE_NUMERATOR
// |d|^degree.
float expected_difference(float d) {
#if DEGREE_NUMERATOR < DEGREE_DENOMINATOR
    return two_thirds_power(d);
#elif DEGREE_NUMERATOR == 1
    return abs(d);
#else
    return d * d;
#endif
}

// What is wrong with the difference of a metric with a degree at d; `there` and `back` are those at d and -d.
uint degree_offence(float d, out float there, out float back) {
    guard_faults = 0;
    there = difference(d);
    back = difference(-d);
    float expected = expected_difference(d);
    float allowed = 1e-4 * expected + 1e-30;
    if (is_faulty(there)) {
        return kFault;
    }
    if (!is_finite(expected)) {
        return kFine;  // beyond the range of float32: the sum will say so
    }
    if (!is_finite(there) || !is_finite(back)) {
        return kNotFinite;
    }
    if (there < 0.0 || back < 0.0) {
        return kNegative;
    }
    if (abs(there - back) > allowed) {
        return kAsymmetric;
    }
    return abs(there - expected) > allowed ? kDegree : kFine;
}
#else
// How far the differences of two samples may be apart, one way and the other.
float allowed_asymmetry(vec3 a, vec3 b, float there, float back) {
    return max(0.01 * max(there, back), 1e-6 * max(1.0, max(length(a), length(b))));
}
#endif
