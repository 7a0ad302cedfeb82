// title: Projected area weighted CIEDE2000
// formula: sqrt( 1/|K| sum_k cos theta_i cos theta_o s_MERL DE00(Lab(f1), Lab(f2))^2 )
// source: CIE 142:2001; the weight and CIELAB of Ryman 2018
// note: CIEDE2000 was fitted to surface colours with small differences: highlights are far outside. It is no
//   metric: the triangle inequality fails.
// parameter: white = 100 in [1e-3, 1e6] the BRDF, in 1/sr and the same in every channel, that is white

#include "lib/cielab.glsl"
#include "lib/ciede2000.glsl"

vec3 transform(vec3 f, Voxel v) { return cielab(100.0 / white * f); }

float weight(Voxel v) { return v.cos_theta_i * v.cos_theta_o * v.s_merl; }

float difference(vec3 a, vec3 b) { return ciede2000_squared(a, b); }
