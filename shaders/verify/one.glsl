// title: Framework test: weight 1
// formula: sqrt( 1/|K| sum_k 1 )
// source: Ryman 2018, equations 4.21-4.27 and table 4.2

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return 1.0; }

float difference(vec3 a, vec3 b) { return 1.0; }
