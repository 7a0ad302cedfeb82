// title: Cosine weighted L2 over solid angle (Ngan)
// formula: sqrt( sum_k w_k sum_c (f1_c cos theta_i - f2_c cos theta_i)^2 / sum_k w_k ), w the solid angle
// source: Ngan, Durand and Matusik, Experimental Analysis of BRDF Models, 2005
// note: The sum of the weights is taken as pi |K|, its exact value over the hemisphere. The paper is said to
//   leave out angles beyond 80 degrees, where MERL is unreliable (largest_angle=80); the implementation in
//   bsdfbenchmark/bbm does not.
// degree: 2
// parameter: largest_angle = 90 in [1, 90] theta_i and theta_o beyond this many degrees weigh nothing

vec3 transform(vec3 f, Voxel v) { return f * v.cos_theta_i; }

float weight(Voxel v) {
    float least = cos(largest_angle * (3.14159265358979324 / 180.0));
    return min(v.cos_theta_i, v.cos_theta_o) >= least ? v.s_merl / 3.14159265358979324 : 0.0;
}

float difference(float d) { return d * d; }
