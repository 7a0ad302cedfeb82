// title: Binary logarithm (Sun)
// formula: sqrt( 1/|K| sum_k sum_c (log2(f1_c m + epsilon) - log2(f2_c m + epsilon))^2 ), m = max(cos theta_i cos theta_o, 1e-3)
// source: Sun, Jensen and Ramamoorthi, Connecting Measured BRDFs to Analytic BRDFs by Data-Driven
//   Diffuse-Specular Separation, 2018
// degree: 2
// parameter: epsilon = 1e-3 in [1e-9, 1e3] added before the logarithm, 1/sr

#include "lib/logarithm.glsl"

// log2(epsilon) is taken off: it drops out of a difference.
vec3 transform(vec3 f, Voxel v) {
    float m = max(v.cos_theta_i * v.cos_theta_o, 1e-3);
    return log_one_plus(f * (m / epsilon)) * 1.44269504088896341;
}

float weight(Voxel v) { return 1.0; }

float difference(float d) { return d * d; }
