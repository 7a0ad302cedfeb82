// Functions that metrics may use beside those of GLSL, for arguments from 1e-30 to 1e30 and zero. The
// C++ twins are in engine/reflectance/metric_cpp.h.
//
// Both start from y, about x^(-1/3): dividing the exponent bits by three is a cube root within 6 %.
// Then e = x y^3 is near 1, and a minimax polynomial of e corrects for what e differs from 1.

float inverse_cube_root_seed(float x) {
    return intBitsToFloat(int(float(0x54a25e4c) - float(floatBitsToInt(x)) * (1.0 / 3.0)));
}

// The cube root of x >= 0, relative error below 2e-7.
float cube_root(float x) {
    float y = inverse_cube_root_seed(x);
    float xy = x * y;
    float t = xy * (y * y) - 1.0;
    float q = -0.666666451 +
              t * (0.555536494 + t * (-0.493941162 + t * (0.458506568 - t * 0.41459983)));
    float r = xy * y;
    return r + r * (t * q);
}

// |d|^(2/3), relative error below 4e-7.
float two_thirds_power(float d) {
    float x = abs(d);
    float y = inverse_cube_root_seed(x);
    float xy = x * y;
    float e = xy * (y * y);
    return xy * (1.87215853 +
                 e * (-1.86969161 + e * (1.59835517 + e * (-0.742940545 + e * 0.142118424))));
}
