// title: Mean absolute logarithmic loss (Neural-BRDF)
// formula: sqrt( 1/|K| sum_k 1/3 sum_c |ln(1 + f1_c cos theta_i) - ln(1 + f2_c cos theta_i)| )
// source: Sztrajman, Rainer, Ritschel and Weyrich, Neural BRDF Representation and Importance Sampling, 2021
// note: The loss is what is under the root; both order all pairs alike. The paper's implementation takes
//   the mean over samples and channels, hence the third. Its samples are random and even over theta_h,
//   above the horizon only; here they are the voxels, of which those below the horizon add nothing.
// degree: 1

#include "lib/logarithm.glsl"

vec3 transform(vec3 f, Voxel v) { return log_one_plus(f * v.cos_theta_i); }

float weight(Voxel v) { return 1.0 / 3.0; }

float difference(float d) { return abs(d); }
