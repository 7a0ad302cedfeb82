// What the functions of a user's metric call instead of the language's own operations
// (engine/metric/check/guards.cpp puts the calls in), so that what goes wrong shows.
//
// GLSL leaves open what dividing by zero gives, or the smaller of a number and a NaN. These give what
// IEEE 754 does, NaN where something is not defined, and lose no NaN. Where no number could say so, as for
// an index, guard_faults keeps it, and the kernels look there.

const uint kEndlessLoop = 1, kBadIndex = 2, kBadDivisor = 4, kBadShift = 8, kBadConversion = 16;
uint guard_faults = 0;

// One invocation gets so many iterations, and then its loops end.
const uint kMostLoops = 32768;
uint guard_loops = 0;

bool guard_loop() {
    ++guard_loops;
    guard_faults |= guard_loops > kMostLoops ? kEndlessLoop : 0;
    return guard_loops <= kMostLoops;
}

// Whether the device ends loops itself, in silence. lavapipe does after 65,535 iterations of invocations
// that run side by side: together when they do the same, one after the other when they do not. Then no loop
// comes to a third iteration. To be asked last.
bool guard_cut() {
    uint three = 3u + (gl_NumWorkGroups.z >> 31);  // which no compiler knows
    uint count = 0;
    for (uint i = 0; i < three; ++i) {
        ++count;
    }
    guard_faults |= count == three ? 0 : kEndlessLoop;
    return count != three;
}

uint guard_index(const in uint index, const in uint size) {
    guard_faults |= index < size ? 0 : kBadIndex;
    return index < size ? index : 0;
}

int guard_index(const in int index, const in int size) {
    return int(guard_index(uint(index), uint(size)));
}

uint guard_divisor(const in uint number, const in uint divisor) {
    guard_faults |= divisor == 0 ? kBadDivisor : 0;
    return divisor == 0 ? 1 : divisor;
}

int guard_divisor(const in int number, const in int divisor) {
    bool bad = divisor == 0 || (divisor == -1 && uint(number) == 0x80000000u);
    guard_faults |= bad ? kBadDivisor : 0;
    return bad ? 1 : divisor;
}

// GLSL leaves the remainder open where one of the two is negative.
int guard_modulus(const in int number, const in int modulus) {
    bool bad = number < 0 || modulus <= 0;
    guard_faults |= bad ? kBadDivisor : 0;
    return bad ? 1 : modulus;
}

uint guard_shift(const in uint shift) {
    guard_faults |= shift < 32 ? 0 : kBadShift;
    return shift & 31u;
}

int guard_shift(const in int shift) { return int(guard_shift(uint(shift))); }

// 0 where an integer cannot hold x. The bounds are the numbers of its type next beyond those it can.
#define GUARD_CONVERSION(name, real, below, above)        \
    real name(const in real x) {                          \
        bool good = x > real(below) && x < real(above);   \
        guard_faults |= good ? 0 : kBadConversion;        \
        return good ? x : real(0);                        \
    }
GUARD_CONVERSION(guard_to_int, float, -2147483904.0, 2147483648.0)
GUARD_CONVERSION(guard_to_int, double, -2147483649.0lf, 2147483648.0lf)
GUARD_CONVERSION(guard_to_uint, float, -1.0, 4294967296.0)
GUARD_CONVERSION(guard_to_uint, double, -1.0lf, 4294967296.0lf)
#undef GUARD_CONVERSION

// A zero that no compiler knows to be one: lavapipe takes 0 times infinity for 0 when it does, and 0 / 0 for
// whatever is in a register. A dispatch has one layer of workgroups.
float guard_zero32() { return uintBitsToFloat(gl_NumWorkGroups.z >> 31); }
double guard_zero64() { return double(guard_zero32()); }
float guard_zero(const in float like) { return guard_zero32(); }
double guard_zero(const in double like) { return guard_zero64(); }

// A number of which no compiler knows that it is 0.
float guard_hidden(const in float x) { return uintBitsToFloat(floatBitsToUint(x) | (gl_NumWorkGroups.z >> 31)); }
double guard_hidden(const in double x) {
    return packDouble2x32(unpackDouble2x32(x) | uvec2(0u, gl_NumWorkGroups.z >> 31));
}

float guard_nan(const in float like) { return uintBitsToFloat(0x7fc00000u); }
double guard_nan(const in double like) { return packDouble2x32(uvec2(0u, 0x7ff80000u)); }

// By their bits, unless the kernel says that NaN and infinity are to be kept: otherwise a compiler may take it
// that there are none.
#ifdef KEEPS_NAN
bool guard_is_nan(const in float x) { return isnan(x); }
bool guard_is_infinite(const in float x) { return isinf(x); }
#else
bool guard_is_nan(const in float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }
bool guard_is_infinite(const in float x) { return (floatBitsToUint(x) & 0x7fffffffu) == 0x7f800000u; }
#endif
bool guard_is_nan(const in double x) {
    uvec2 bits = unpackDouble2x32(x);
    uint high = bits.y & 0x7fffffffu;
    return high > 0x7ff00000u || (high == 0x7ff00000u && bits.x != 0u);
}
bool guard_is_infinite(const in double x) {
    uvec2 bits = unpackDouble2x32(x);
    return bits.x == 0u && (bits.y & 0x7fffffffu) == 0x7ff00000u;
}

// Infinity with the sign of x.
float guard_infinity(const in float x) {
    return uintBitsToFloat(0x7f800000u | (floatBitsToUint(x) & 0x80000000u));
}
double guard_infinity(const in double x) {
    return packDouble2x32(uvec2(0u, 0x7ff00000u | (unpackDouble2x32(x).y & 0x80000000u)));
}

#define GUARDS(real)                                                                                    \
    /* A device that knows a to be 0 takes a * infinity for 0. */                                       \
    real guard_divide(const in real a, const in real b) {                                               \
        if (b != real(0)) {                                                                             \
            return a / b;                                                                               \
        }                                                                                               \
        return guard_is_nan(a) || a == real(0) ? guard_nan(a) : a * guard_infinity(b);                         \
    }                                                                                                   \
    real guard_modulo(const in real a, const in real b) {                                               \
        return b == real(0) || guard_is_infinite(a) || guard_is_infinite(b) ? guard_nan(a) : mod(a, b);                         \
    }                                                                                                   \
    real guard_min(const in real a, const in real b) {                                                  \
        return guard_is_nan(a) || guard_is_nan(b) ? guard_nan(a) : min(a, b);                                         \
    }                                                                                                   \
    real guard_max(const in real a, const in real b) {                                                  \
        return guard_is_nan(a) || guard_is_nan(b) ? guard_nan(a) : max(a, b);                                         \
    }                                                                                                   \
    real guard_clamp(const in real x, const in real low, const in real high) {                          \
        return guard_is_nan(x) || guard_is_nan(low) || guard_is_nan(high) ? guard_nan(x) : min(max(x, low), high);           \
    }                                                                                                   \
    real guard_sign(const in real x) { return guard_is_nan(x) ? x : sign(x); }                                 \
    real guard_step(const in real edge, const in real x) {                                              \
        return guard_is_nan(edge) || guard_is_nan(x) ? guard_nan(x) : step(edge, x);                                  \
    }                                                                                                   \
    real guard_smoothstep(const in real low, const in real high, const in real x) {                     \
        precise real from_low = x - low;                                                                \
        precise real range = high - low;                                                                \
        real t = guard_clamp(guard_divide(from_low, range), real(0), real(1));                          \
        return t * t * (real(3) - real(2) * t);                                                         \
    }                                                                                                   \
    real guard_mix(const in real x, const in real y, const in real a) {                                 \
        precise real mixed = x * (real(1) - a + guard_zero(a)) + y * a;                                 \
        return mixed;                                                                                   \
    }                                                                                                   \
    /* 1, unless something is of no size and has no direction or inverse. */                            \
    real guard_size(const in real size) {                                                               \
        return size == real(0) || guard_is_nan(size) || guard_is_infinite(size) ? guard_nan(size) : real(1);               \
    }
GUARDS(float)
GUARDS(double)
#undef GUARDS

// NaN also where GLSL leaves it open: for x < 0, and for x = 0 without a y > 0.
float guard_pow(const in float x, const in float y) {
    return guard_is_nan(x) || guard_is_nan(y) || x < 0.0 || (x == 0.0 && !(y > 0.0)) ? guard_nan(x) : pow(x, y);
}

float guard_atan(const in float x) { return guard_is_nan(x) ? x : atan(x); }

float guard_atan(const in float y, const in float x) {
    if (guard_is_nan(x) || guard_is_nan(y) || (guard_is_infinite(x) && guard_is_infinite(y))) {
        return guard_nan(x);
    }
    if (x == 0.0 && y == 0.0) {
        float turn = (floatBitsToUint(x) & 0x80000000u) == 0u ? 0.0 : 3.14159265;
        return (floatBitsToUint(y) & 0x80000000u) == 0u ? turn : -turn;
    }
    return atan(y, x);
}
