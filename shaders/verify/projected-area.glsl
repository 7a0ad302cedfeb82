// title: Framework test: projected area
// formula: sqrt( 1/|K| sum_k cos theta_i cos theta_o s_MERL )
// source: Ryman 2018, equations 4.21-4.27 and table 4.2

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return v.cos_theta_i * v.cos_theta_o * v.s_merl; }

float difference(vec3 a, vec3 b) { return 1.0; }
