// title: Log-relative (Nielsen)
// formula: sqrt( 1/|K| sum_k sum_c ln^2((f1_c m + epsilon) / (f2_c m + epsilon)) ), m = max(cos theta_i cos theta_o, clip)
// source: Nielsen, Jensen and Ramamoorthi, On Optimal, Minimal BRDF Sampling for Reflectance Acquisition, 2015
// note: The paper maps a BRDF to ln((f m + epsilon) / (f_ref m + epsilon)); the reference drops out of a
//   difference. The authors clip the cosines to [0.01, 1] (clip=0.01). With the defaults this is sun-log2
//   times ln 2.
// degree: 2
// parameter: epsilon = 1e-3 in [1e-9, 1] added before the logarithm, 1/sr
// parameter: clip = 1e-3 in [0, 1] the least cosine factor m

#include "lib/logarithm.glsl"

// ln(epsilon) is taken off like the reference.
vec3 transform(vec3 f, Voxel v) {
    float m = max(v.cos_theta_i * v.cos_theta_o, clip);
    return log_one_plus(f * (m / epsilon));
}

float weight(Voxel v) { return 1.0; }

float difference(float d) { return d * d; }
