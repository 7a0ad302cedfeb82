// title: Cosine Weighted Cube Root (CWCbrt)
// formula: sqrt( 1/|K| sum_k (cos^2 theta_i)^(1/3) sum_c ((f1_c - f2_c)^2)^(1/3) )
// source: Fores, Ferwerda and Gu 2012; three channels as Ryman 2018, equations 4.34-4.35
// degree: 2/3

vec3 transform(vec3 f, Voxel v) { return f; }

float weight(Voxel v) { return cube_root(v.cos_theta_i * v.cos_theta_i); }

float difference(float d) { return two_thirds_power(d); }
