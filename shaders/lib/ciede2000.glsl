// The colour difference CIEDE2000 of two colours in CIELAB, with all three parametric factors 1 (CIE
// 142:2001; G. Sharma, W. Wu, E. Dalal, "The CIEDE2000 color-difference formula: implementation notes",
// Color Research and Application 30(1), 2005).
//
// Written without branches and with few roots and divisions, so that a loop over it becomes vectors.
// Hues are directions, so that their mean needs no cases: it is the direction of their sum. Nothing
// changes but a sign, in pairs, where the colours change places: the difference is the same to the bit.

// sqrt(x^7 / (x^7 + 25^7)) for a chroma x; 1 to the last digit beyond 25000.
float ciede2000_chroma_root(float x) {
    float y = min(0.04 * x, 1000.0);
    float y2 = y * y;
    float y7 = y2 * y2 * y2 * y;
    return sqrt(y7 / (1.0 + y7));
}

float ciede2000_squared(vec3 lab1, vec3 lab2) {
    float mean_chroma = 0.5 * (sqrt(lab1.y * lab1.y + lab1.z * lab1.z) + sqrt(lab2.y * lab2.y + lab2.z * lab2.z));
    float stretch = 1.5 - 0.5 * ciede2000_chroma_root(mean_chroma);
    float a1 = stretch * lab1.y;
    float a2 = stretch * lab2.y;
    float b1 = lab1.z;
    float b2 = lab2.z;
    float c1 = sqrt(a1 * a1 + b1 * b1);
    float c2 = sqrt(a2 * a2 + b2 * b2);
    float c = 0.5 * (c1 + c2);
    float l = 0.5 * (lab1.x + lab2.x) - 50.0;
    float apart_a = a2 - a1;
    float apart_b = b2 - b1;
    float apart_c = c2 - c1;

    // The mean hue is the direction of u1 + u2, the sum of both directions, and square to u1 - u2: whichever
    // of the two is longer is taken, times c1 c2, so that nothing cancels. Which side of u1 - u2 the sign of
    // the cross product c1 c2 sin(dh) says; of opposite colours hues from 0 to 360 degrees do. Grey has no
    // hue and needs none.
    float cross_product = 0.5 * ((a1 + a2) * apart_b - (b1 + b2) * apart_a);
    bool is_far = a1 * a2 + b1 * b2 < 0.0;
    bool is_left = cross_product > 0.0 ||
                   (cross_product == 0.0 && (apart_b < 0.0 || (apart_b == 0.0 && apart_a < 0.0)));
    float side = is_left ? 1.0 : -1.0;
    float half_c = 0.5 * apart_c;
    float x = is_far ? side * (c * apart_b - half_c * (b1 + b2)) : c * (a1 + a2) - half_c * apart_a;
    float y = is_far ? side * (half_c * (a1 + a2) - c * apart_a) : c * (b1 + b2) - half_c * apart_b;
    float scale = 1.0 / sqrt(max(x * x + y * y, 1e-37));
    float cos1 = x * scale;
    float sin1 = y * scale;

    // Hue difference 2 sqrt(c1 c2) sin(dh / 2). The lengths of sum and difference are 2 c1 c2 cos(dh / 2) and
    // 2 c1 c2 sin(dh / 2), so the cross product over the one is sin(dh / 2), over the other cos(dh / 2).
    float ratio = min(max(cross_product * scale, -1.0), 1.0);
    float sine = is_far ? side * sqrt(1.0 - ratio * ratio) : ratio;
    float dh = 2.0 * sqrt(c1 * c2) * sine;

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
    float rotation = -2.0 * ciede2000_chroma_root(c) * sin(turn);

    float root = sqrt(20.0 + l * l);
    float dl = (lab2.x - lab1.x) * root / (root + 0.015 * l * l);
    float dc = apart_c / (1.0 + 0.045 * c);
    dh = dh / (1.0 + 0.015 * c * t);
    return max(0.0, dl * dl + dc * dc + dh * dh + rotation * dc * dh);
}

float ciede2000(vec3 lab1, vec3 lab2) { return sqrt(ciede2000_squared(lab1, lab2)); }
