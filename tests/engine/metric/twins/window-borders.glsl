// title: Windows whose borders are centres on some grids
// window: near_d theta_d from 5 to 25 degrees
// window: layers layers 3 to 5 of 90
// window: half_h theta_h from 22.5 to 40 degrees
// window: half_weight half of the voxels, with a weight of their own
// features: 2

#include "lib/windows.glsl"

float window(int w, Voxel v) {
    return w == near_d   ? (theta_d_between(v, 5.0, 25.0) ? 1.0 : 0.0)
           : w == layers ? (layer_between(v, 3.0, 6.0) ? 1.0 : 0.0)
           : w == half_h ? (theta_h_between(v, 22.5, 40.0) ? 1.0 : 0.0)
                         : max(0.0, v.theta_d - 0.7);
}

float feature(int i, Means m) {
    vec3 c = m.rgb[half_weight];
    return i == 0 ? log(c.x + 1.0) : c.y - c.z;
}
