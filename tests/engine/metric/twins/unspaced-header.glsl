//title: A header without spaces, and a matrix
//degree: 2
//parameter: gain = 2 in [0, 10] what a sample is multiplied with
vec3 transform(vec3 f, Voxel v) {
    mat3 swap = mat3(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, gain);
    return swap * f;
}
float weight(Voxel v) { return v.cos_theta_i; }
float difference(float d) { return d * d; }
