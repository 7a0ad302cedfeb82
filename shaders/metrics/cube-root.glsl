// title: Cube root transform
// formula: sqrt( 1/|K| sum_k sum_c ((f1_c cos theta_i)^(1/3) - (f2_c cos theta_i)^(1/3))^2 )
// source: a reading of Fores, Ferwerda and Gu 2012 that is common in code
// note: Not cwcbrt: there the root is taken of the difference, here the difference of the roots.
// degree: 2

vec3 transform(vec3 f, Voxel v) {
    return vec3(cube_root(f.x * v.cos_theta_i), cube_root(f.y * v.cos_theta_i),
                cube_root(f.z * v.cos_theta_i));
}

float weight(Voxel v) { return 1.0; }

float difference(float d) { return d * d; }
