// The colour difference CIEDE2000 of two colours in CIELAB, with all three parametric factors 1 (CIE
// 142:2001; G. Sharma, W. Wu, E. Dalal, "The CIEDE2000 color-difference formula: implementation notes",
// Color Research and Application 30(1), 2005).
//
// Hues are kept as unit vectors, so that their mean needs no cases: it is the direction of their sum.

// x^7 / (x^7 + 25^7) for a chroma x.
float ciede2000_chroma_share(float x) {
    float q = 25.0 / max(x, 1e-3);
    float square = q * q;
    return 1.0 / (1.0 + square * square * square * q);
}

float ciede2000_squared(vec3 lab1, vec3 lab2) {
    float mean_chroma = 0.5 * (length(vec2(lab1.y, lab1.z)) + length(vec2(lab2.y, lab2.z)));
    float stretch = 1.5 - 0.5 * sqrt(ciede2000_chroma_share(mean_chroma));
    vec2 ab1 = vec2(stretch * lab1.y, lab1.z);
    vec2 ab2 = vec2(stretch * lab2.y, lab2.z);
    float c1 = length(ab1);
    float c2 = length(ab2);
    float c = 0.5 * (c1 + c2);
    float l = 0.5 * (lab1.x + lab2.x) - 50.0;

    // Hue difference 2 sqrt(c1 c2) sin(dh / 2) from the cross and the dot product. The former is half
    // that of sum and difference, which is the same to the last bit, but for its sign, for both orders.
    vec2 sum = ab1 + ab2;
    vec2 apart = ab2 - ab1;
    float cross_product = 0.5 * (sum.x * apart.y - sum.y * apart.x);
    float cosine = c1 * c2 + dot(ab1, ab2);
    float largest = 2.0 * sqrt(c1 * c2);
    float dh = cosine > 0.0 ? cross_product / sqrt(0.5 * cosine) : largest;
    dh = min(max(dh, -largest), largest);

    // The mean hue: cosine and sine. Grey has no hue and leaves it to the other.
    vec2 hue = vec2(0.0, 0.0);
    if (c1 > 0.0) {
        hue += ab1 / c1;
    }
    if (c2 > 0.0) {
        hue += ab2 / c2;
    }
    float size = length(hue);
    if (size > 0.0) {
        hue /= size;
    } else {  // opposite: halfway from the one above the a axis
        vec2 above = ab1.y > 0.0 || (ab1.y == 0.0 && ab1.x > 0.0) ? ab1 : ab2;
        hue = c > 0.0 ? vec2(-above.y, above.x) / length(above) : vec2(1.0, 0.0);
    }
    float cos1 = hue.x;
    float sin1 = hue.y;
    float cos2 = cos1 * cos1 - sin1 * sin1;
    float sin2 = 2.0 * cos1 * sin1;
    float cos3 = cos1 * cos2 - sin1 * sin2;
    float sin3 = sin1 * cos2 + cos1 * sin2;
    float cos4 = cos2 * cos2 - sin2 * sin2;
    float sin4 = 2.0 * cos2 * sin2;
    float t = 1.0 - 0.17 * (0.866025403784438647 * cos1 + 0.5 * sin1) + 0.24 * cos2 +
              0.32 * (0.994521895368273337 * cos3 - 0.104528463267653471 * sin3) -
              0.20 * (0.453990499739546792 * cos4 + 0.891006524188367862 * sin4);

    // The rotation around blue: degrees from a hue of 275.
    float from_blue = 57.2957795130823209 *
                      atan(0.996194698091745532 * cos1 + 0.0871557427476581736 * sin1,
                           0.0871557427476581736 * cos1 - 0.996194698091745532 * sin1) / 25.0;
    float turn = 1.04719755119659775 * exp(-from_blue * from_blue);  // twice 30 degrees, in radians
    float rotation = -2.0 * sqrt(ciede2000_chroma_share(c)) * sin(turn);

    float dl = (lab2.x - lab1.x) / (1.0 + 0.015 * l * l / sqrt(20.0 + l * l));
    float dc = (c2 - c1) / (1.0 + 0.045 * c);
    dh = dh / (1.0 + 0.015 * c * t);
    return max(0.0, dl * dl + dc * dc + dh * dh + rotation * dc * dh);
}

float ciede2000(vec3 lab1, vec3 lab2) { return sqrt(ciede2000_squared(lab1, lab2)); }
