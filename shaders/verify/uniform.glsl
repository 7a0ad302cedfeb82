// title: Framework test: all pairs of directions
// formula: sqrt( 1/|K| sum_k s_MERL )
// source: Ryman 2018, equations 4.21-4.27 and table 4.2

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return v.s_merl; }

float difference(vec3 a, vec3 b) { return 1.0; }
