// title: Contrast between the highlight and the far off-specular level, and colour
// formula: || z1 - z2 ||, of the luminances P, G, O and W_n of the mean RGB over each window and o the mean RGB of O:
//   z_1 = ln((P + dark) / (P + knee)) + haze ln((G + knee) / ((O + knee) (O + dark))),
//   z_2 = saturation (max o - min o) / (max o + dark), z_3 = gloss ln(G + dark),
//   z_4 = red_green ln((o_R + tint) / (o_G + tint)),
//   z_5 = blue_yellow (ln(o_R + tint) / 2 + ln(o_G + tint) / 2 - ln(o_B + tint)),
//   z_6 to z_15 = sqrt(profile) ln(W_n + dark)
// source: this program (docs/gloss-contrast.md)
// fitted: eafd46b57a8220d7b650961dd119faabf30424620828eb37a7d00b0390085214 the train split of Lagunas et al., A Similarity
//   Measure for Material Appearance, ACM TOG 38(4), 2019
// note: Means over voxel centres with 5 <= theta_d < 25 degrees, of each channel where it was measured.
// window: peak P, 0.5 <= theta_h < 2 degrees
// window: lobe G, 7 <= theta_h < 15 degrees
// window: off O, 50 <= theta_h < 75 degrees
// window: layers_0 W_1, of the 90 layers of theta_h those from 0 to 2
// window: layers_3 W_2, from 3 to 5
// window: layers_6 W_3, from 6 to 11
// window: layers_12 W_4, from 12 to 17
// window: layers_18 W_5, from 18 to 26
// window: layers_27 W_6, from 27 to 38
// window: layers_39 W_7, from 39 to 53
// window: layers_54 W_8, from 54 to 65
// window: layers_66 W_9, from 66 to 77
// window: layers_78 W_10, from 78 to 89
// features: 15
// parameter: dark = 0.001 in [1e-9, 1] added to what a logarithm is taken of, 1/sr
// parameter: knee = 0.06 in [1e-9, 10] the level, in 1/sr, beyond which a highlight looks no brighter
// parameter: haze = 0.44 in [0, 10] weight of the lobe against the off-specular level
// parameter: saturation = 0.9 in [0, 10] weight of the saturation
// parameter: gloss = 0.24 in [0, 10] weight of the lobe
// parameter: red_green = 0.25 in [0, 10] weight of the hue
// parameter: blue_yellow = 0.25 in [0, 10] weight of the hue
// parameter: tint = 0.01 in [1e-9, 1] added to channels before they are compared, 1/sr
// parameter: profile = 0.0084 in [0, 10] weight of the whole profile over theta_h

#include "lib/windows.glsl"

// The first layer of the nth window of the profile.
float layer(int n) {
    return n < 3 ? 3.0 * float(n) : n < 5 ? 6.0 * float(n - 1) : n == 5 ? 27.0 : n == 6 ? 39.0 : 12.0 * float(n) - 30.0;
}

float window(int w, Voxel v) {
    bool inside = w == peak  ? theta_h_between(v, 0.5, 2.0)
                  : w == lobe ? theta_h_between(v, 7.0, 15.0)
                  : w == off  ? theta_h_between(v, 50.0, 75.0)
                              : layer_between(v, layer(w - layers_0), layer(w - layers_0 + 1));
    return inside && theta_d_between(v, 5.0, 25.0) ? 1.0 : 0.0;
}

float luminance(vec3 c) { return 0.212671 * c.x + 0.715160 * c.y + 0.072169 * c.z; }

float feature(int i, Means m) {
    float p = luminance(m.rgb[peak]);
    float g = luminance(m.rgb[lobe]);
    float o = luminance(m.rgb[off]);
    vec3 c = m.rgb[off];
    float most = max(max(c.x, c.y), c.z);
    float least = min(min(c.x, c.y), c.z);
    if (i == 0) {
        return log((p + dark) / (p + knee)) + haze * log((g + knee) / ((o + knee) * (o + dark)));
    }
    if (i == 1) {
        return saturation * (most - least) / (most + dark);
    }
    if (i == 2) {
        return gloss * log(g + dark);
    }
    vec3 t = log(c + vec3(tint));
    if (i == 3) {
        return red_green * (t.x - t.y);
    }
    if (i == 4) {
        return blue_yellow * (0.5 * t.x + 0.5 * t.y - t.z);
    }
    return sqrt(profile) * log(luminance(m.rgb[layers_0 + i - 5]) + dark);
}
