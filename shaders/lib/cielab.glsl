// CIELAB of linear RGB for a white point of D65 and the 2 degree observer (CIE 15:2004), with the
// matrix of Ryman 2018, equation 4.28. RGB is taken as it is: a reflectance of 100/sr is white.

// F of CIELAB less the constant 16/116, which drops out of L, a and b: so dark colours keep all
// their digits.
float cielab_f(float t) {
    const float knee = (24.0 / 116.0) * (24.0 / 116.0) * (24.0 / 116.0);
    return t > knee ? cube_root(t) - 16.0 / 116.0 : (841.0 / 108.0) * t;
}

vec3 cielab(vec3 rgb) {
    float x = cielab_f((0.412453 * rgb.x + 0.357580 * rgb.y + 0.180423 * rgb.z) / 95.047);
    float y = cielab_f((0.212671 * rgb.x + 0.715160 * rgb.y + 0.072169 * rgb.z) / 100.0);
    float z = cielab_f((0.019334 * rgb.x + 0.119193 * rgb.y + 0.950227 * rgb.z) / 108.883);
    return vec3(116.0 * y, 500.0 * (x - y), 200.0 * (y - z));
}
