// title: Cosine weighted root mean square error
// formula: sqrt( 1/|K| sum_k cos^2 theta_i sum_c (f1_c - f2_c)^2 )
// source: Ryman 2018, equation 2.12
// degree: 2

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return v.cos_theta_i * v.cos_theta_i; }

float difference(float d) { return d * d; }
