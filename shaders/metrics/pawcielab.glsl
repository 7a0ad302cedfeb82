// title: Projected Area Weighted CIELAB (PAWCIELAB)
// formula: sqrt( 1/|K| sum_k cos theta_i cos theta_o s_MERL |Lab(f1) - Lab(f2)|^2 )
// source: Ryman 2018, equations 3.6, 4.20 and 4.28-4.33
// degree: 2
// parameter: white = 100 in [1e-3, 1e6] the BRDF, in 1/sr and the same in every channel, that is white

#include "lib/cielab.glsl"

vec3 transform(vec3 f, Voxel v) { return cielab(100.0 / white * f); }

float weight(Voxel v) { return v.cos_theta_i * v.cos_theta_o * v.s_merl; }

float difference(float d) { return d * d; }
