// Functions that metrics may use beside those of GLSL. Both GLSL and C++ (through GLM) compile this
// file; float and double are what they say.
//
// All start from y, about x^(-1/3): dividing the bits by three takes the root of the exponent. That is
// within 4 % of a multiple of it.

int third_of_bits(float x) { return int(float(floatBitsToInt(x)) * (1.0f / 3.0f)); }

float inverse_cube_root_seed(float x) {
    return intBitsToFloat(0x54a25e4c - third_of_bits(x));
}

#ifndef __cplusplus
// The same for a double; its counterpart in C++ (engine/base/glsl_in_float64.h) is made of vector instructions.
double inverse_cube_root_seed(double x) {
    return packDouble2x32(uvec2(0u, 0x553e0000u - unpackDouble2x32(x).y / 3u));
}
#endif

// The cube root of x, for 0 and every normal positive double; relative error below 4e-16. A subnormal
// x gives a number from 0 to 1e-102. The seed is corrected to 1.4e-6 by a minimax polynomial for
// (1 - e)^(-1/3), and from there by three terms of the series of (1 - e)^(-2/3), where e = 1 - x y^3.
double cube_root_from_zero(double x) {
    double y = inverse_cube_root_seed(x);
    double off = double(1) - x * y * (y * y);
    y *= double(0.9999886633) +
         off * (double(0.3340153681) + off * (double(0.2100544663) + off * double(0.2521156963)));
    double root = x * y * y;
    double e = double(1) - root * y;
    return root + root * (e * (double(2) / double(3) + e * (double(5) / double(9))));
}

#ifdef __cplusplus
double cube_root(double x) { return cube_root_from_zero(x); }  // the library takes no other roots
#else
double cube_root(double x) {
    double root = cube_root_from_zero(abs(x));
    return x < double(0) ? -root : root;
}
#endif

float cube_root(float x) { return float(cube_root(double(x))); }

// |d|^(2/3).
double two_thirds_power(double d) {
    double root = cube_root(abs(d));
    return root * root;
}

#ifndef __cplusplus
// |d|^(2/3), relative error below 4e-7, mean below 1e-8. With the seed scaled so, the polynomial has
// leading coefficient 1, which saves a multiplication of sixteen.
vec4 two_thirds_power(vec4 d) {
    vec4 x = abs(d);
    vec4 y = intBitsToFloat(0x5486ca00 - ivec4(vec4(floatBitsToInt(x)) * (1.0f / 3.0f)));
    vec4 xy = x * y;
    vec4 e = xy * (y * y);
    return xy * (2.17506909f + e * (-3.40676427f + e * (4.56838512f + e * (e - 3.33147216f))));
}

float two_thirds_power(float d) { return two_thirds_power(vec4(d)).x; }
#endif
