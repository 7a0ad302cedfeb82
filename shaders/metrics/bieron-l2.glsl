// title: Cosine weighted L2 (Bieron and Peers)
// formula: sqrt( 1/|K| sum_k s_MERL cos theta_o sum_c (f1_c cos theta_i - f2_c cos theta_i)^2 )
// source: Bieron and Peers, An Adaptive BRDF Fitting Metric, 2020; as in their bsdfbenchmark/bbm
// degree: 2

vec3 transform(vec3 f, Voxel v) { return f * v.cos_theta_i; }

float weight(Voxel v) { return v.s_merl * v.cos_theta_o; }

float difference(float d) { return d * d; }
