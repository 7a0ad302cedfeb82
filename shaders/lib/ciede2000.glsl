// The colour difference CIEDE2000 of two colours in CIELAB, with all three parametric factors 1 (CIE
// 142:2001; G. Sharma, W. Wu, E. Dalal, "The CIEDE2000 color-difference formula: implementation notes",
// Color Research and Application 30(1), 2005).
//
// Written without branches and with few roots and divisions, so that a loop over it becomes vectors.
// Hues are directions, so that their mean needs no cases: it is the direction of their sum. Nothing
// changes but a sign, in pairs, where the colours change places: the difference is the same to the bit.

// sqrt(x^7 / (x^7 + 25^7)) for half a sum x of chromas; 1 to the last digit beyond 2500.
float ciede2000_chroma_root(float sum) {
    float y = min(0.02 * sum, 100.0);
    float y2 = y * y;
    float y7 = y2 * y2 * y2 * y;
    return sqrt(y7 / (1.0 + y7));
}

float ciede2000_squared(vec3 lab1, vec3 lab2) {
    float chromas = sqrt(lab1.y * lab1.y + lab1.z * lab1.z) + sqrt(lab2.y * lab2.y + lab2.z * lab2.z);
    float stretch = 1.5 - 0.5 * ciede2000_chroma_root(chromas);
    float a1 = stretch * lab1.y;
    float a2 = stretch * lab2.y;
    float b1 = lab1.z;
    float b2 = lab2.z;
    float c1 = sqrt(a1 * a1 + b1 * b1);
    float c2 = sqrt(a2 * a2 + b2 * b2);
    float l = 0.5 * (lab1.x + lab2.x) - 50.0;
    float sum_a = a1 + a2;
    float sum_b = b1 + b2;
    float sum_c = c1 + c2;
    float apart_a = a2 - a1;
    float apart_b = b2 - b1;
    float apart_c = c2 - c1;

    // The mean hue is the direction of u1 + u2, the sum of both directions, and square to u1 - u2: whichever
    // of the two is longer is taken, times c1 c2, so that nothing cancels. Which side of u1 - u2 the sign of
    // the cross product c1 c2 sin(dh) says, here twice that; of opposite colours hues from 0 to 360 degrees do.
    // Grey has no hue and needs none.
    float cross_product = sum_a * apart_b - sum_b * apart_a;
    bool is_far = a1 * a2 + b1 * b2 < 0.0;
    float tie = apart_b == 0.0 ? apart_a : apart_b;
    float left = cross_product == 0.0 ? -tie : cross_product;
    float side = left > 0.0 ? 1.0 : -1.0;
    float a1_c2 = a1 * c2;
    float a2_c1 = a2 * c1;
    float b1_c2 = b1 * c2;
    float b2_c1 = b2 * c1;
    float turned = is_far ? side : 1.0;
    // Sums of the larger and the smaller are the same in both orders also where a compiler fuses operations.
    float x1 = is_far ? b2_c1 : a1_c2;
    float x2 = is_far ? -b1_c2 : a2_c1;
    float y1 = is_far ? a1_c2 : b1_c2;
    float y2 = is_far ? -a2_c1 : b2_c1;
    float x = turned * (max(x1, x2) + min(x1, x2));
    float y = turned * (max(y1, y2) + min(y1, y2));
    float square = x * x + y * y;
    float scale = 1.0 / sqrt(max(square, 1e-37));
    float cos1 = x * scale;
    float sin1 = y * scale;

    // Hue difference 2 sqrt(c1 c2) sin(dh / 2). (x, y) is 2 c1 c2 sin(dh / 2) long where it is the difference, and
    // 2 c1 c2 cos(dh / 2) where it is the sum: the cross product over that is twice the sine.
    float product = c1 * c2;
    float inverse = 1.0 / sqrt(max(product, 1e-37));
    float dh = inverse * scale * (is_far ? side * square : product * cross_product);

    // 1 - 0.17 cos(h - 30) + 0.24 cos(2 h) + 0.32 cos(3 h + 6) - 0.20 cos(4 h - 63), in degrees, where
    // cos(3 h) = cos(h) (2 cos(2 h) - 1) and sin(3 h) = sin(h) (2 cos(2 h) + 1).
    float cos2 = 2.0 * cos1 * cos1 - 1.0;
    float sin2 = 2.0 * cos1 * sin1;
    float t = 1.0 + 0.20 * 0.453990499739546792 +
              cos1 * ((2.0 * 0.32 * 0.994521895368273337) * cos2 -
                      (0.32 * 0.994521895368273337 + 0.17 * 0.866025403784438647)) -
              sin1 * ((2.0 * 0.32 * 0.104528463267653471) * cos2 + (0.32 * 0.104528463267653471 + 0.17 * 0.5)) +
              cos2 * (0.24 - (0.40 * 0.453990499739546792) * cos2 - (0.40 * 0.891006524188367862) * sin2);

    // The rotation around blue: degrees from a hue of 275, over 25.
    float from_blue = (57.2957795130823209 / 25.0) *
                      atan(0.996194698091745532 * cos1 + 0.0871557427476581736 * sin1,
                           0.0871557427476581736 * cos1 - 0.996194698091745532 * sin1);
    float turn = 1.04719755119659775 * exp(-from_blue * from_blue);  // twice 30 degrees, in radians
    float rotation = -2.0 * ciede2000_chroma_root(sum_c) * sin(turn);

    // Each difference over its weight, where all three share a division.
    float l2 = l * l;
    float weight_l = 1.0 + 0.015 * l2 / sqrt(20.0 + l2);
    float weight_c = 1.0 + 0.0225 * sum_c;
    float weight_h = 1.0 + 0.0075 * sum_c * t;
    float weight_ch = weight_c * weight_h;
    float unit = 1.0 / (weight_l * weight_ch);
    float dl = (lab2.x - lab1.x) * weight_ch * unit;
    unit = weight_l * unit;
    float dc = apart_c * weight_h * unit;
    dh = dh * weight_c * unit;
    return max(0.0, dl * dl + dc * dc + dh * dh + rotation * dc * dh);
}

float ciede2000(vec3 lab1, vec3 lab2) { return sqrt(ciede2000_squared(lab1, lab2)); }
