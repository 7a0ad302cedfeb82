// title: Logarithmic (Low)
// formula: sqrt( 1/|K| sum_k s_MERL / max(sin theta_o, 10^-3) sum_c (ln(1 + f1_c cos theta_i) - ln(1 + f2_c cos theta_i))^2 )
// source: Low, Kronander, Ynnerman and Unger, BRDF Models for Accurate and Efficient Rendering of Glossy
//   Surfaces, 2012
// note: The weight is that of bsdfbenchmark/bbm: sin theta_i for samples that are even in theta_i, theta_o
//   and phi. In the domain of MERL that is s_MERL / sin theta_o, which has no bound at theta_o = 0: sin
//   theta_o counts as 10^-3 at least, a floor of this program. Nothing here was compared with the paper's own
//   code.
// degree: 2

#include "lib/logarithm.glsl"

vec3 transform(vec3 f, Voxel v) { return log_one_plus(f * v.cos_theta_i); }

float weight(Voxel v) {
    return v.s_merl / sqrt(max(1.0 - v.cos_theta_o * v.cos_theta_o, 1e-6));
}

float difference(float d) { return d * d; }
