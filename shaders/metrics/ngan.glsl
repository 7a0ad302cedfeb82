// title: Cosine weighted L2 over solid angle (Ngan)
// formula: sqrt( sum_k w_k sum_c (f1_c cos theta_i - f2_c cos theta_i)^2 / sum_k w_k ), w the solid angle where both angles are at most largest_angle
// source: Ngan, Durand and Matusik, Experimental Analysis of BRDF Models, 2005
// note: The sum of the weights is taken as pi (1 - cos largest_angle)^2 |K|, its exact value over the two
//   cones of directions that are left. The paper is said to leave out angles beyond 80 degrees, where MERL is
//   unreliable (largest_angle=80); the implementation in bsdfbenchmark/bbm does not.
// degree: 2
// parameter: largest_angle = 90 in [1, 90] theta_i and theta_o beyond this many degrees weigh nothing

vec3 transform(vec3 f, Voxel v) { return f * v.cos_theta_i; }

float weight(Voxel v) {
    float least = cos(largest_angle * (3.14159265358979324 / 180.0));
    float height = largest_angle < 90.0 ? 1.0 - least : 1.0;  // exactly 1, as the hemisphere's is
    return min(v.cos_theta_i, v.cos_theta_o) >= least ? v.s_merl / (3.14159265358979324 * height * height) : 0.0;
}

float difference(float d) { return d * d; }
