// title: Logarithms in and far from the highlight
// formula: sqrt( 1/|K| sum_k w_k || t(f1) - t(f2) ||^2 ), where 5 <= theta_d < 25 degrees:
//   for 0.5 <= theta_h < 2 degrees w = peak and t = (ln(Y + 0.001), 0, 0),
//   for 50 <= theta_h < 75 w = off and t = (ln(Y + 0.001), saturation (max - min) / (max + 0.001), red_green ln((R + 0.01) / (G + 0.01)));
//   elsewhere w = 0. Y is the luminance
// source: this program (docs/gloss-contrast.md)
// fitted: eafd46b57a8220d7b650961dd119faabf30424620828eb37a7d00b0390085214 the train split of Lagunas et al., A Similarity
//   Measure for Material Appearance, ACM TOG 38(4), 2019
// degree: 2
// window: highlight 0.5 <= theta_h < 2 degrees
// window: off_specular 50 <= theta_h < 75 degrees
// parameter: peak = 2.5 in [0, 100] weight of the highlight
// parameter: off = 1.05 in [0, 100] weight of the off-specular level
// parameter: saturation = 1.73 in [0, 10] of the off-specular saturation
// parameter: red_green = 0.89 in [0, 10] of the off-specular hue

#include "lib/windows.glsl"

bool in_peak(Voxel v) { return theta_h_between(v, 0.5, 2.0) && theta_d_between(v, 5.0, 25.0); }
bool in_off(Voxel v) { return theta_h_between(v, 50.0, 75.0) && theta_d_between(v, 5.0, 25.0); }

float window(int w, Voxel v) { return (w == highlight ? in_peak(v) : in_off(v)) ? 1.0 : 0.0; }

vec3 transform(vec3 f, Voxel v) {
    float lightness = log(0.212671 * f.x + 0.715160 * f.y + 0.072169 * f.z + 0.001);
    float most = max(max(f.x, f.y), f.z);
    float least = min(min(f.x, f.y), f.z);
    vec3 colour = vec3(lightness, saturation * (most - least) / (most + 0.001), red_green * log((f.x + 0.01) / (f.y + 0.01)));
    return in_peak(v) ? vec3(lightness, 0.0, 0.0) : colour;
}

float weight(Voxel v) { return in_peak(v) ? peak : in_off(v) ? off : 0.0; }

float difference(float d) { return d * d; }
