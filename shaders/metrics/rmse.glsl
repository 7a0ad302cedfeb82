// title: Root mean square error (RMSE)
// formula: sqrt( 1/|K| sum_k sum_c (f1_c - f2_c)^2 )
// source: Ryman 2018, equation 2.11
// degree: 2

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return 1.0; }

float difference(float d) { return d * d; }
