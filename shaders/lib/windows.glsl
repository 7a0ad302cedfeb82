// Whether the centre of a voxel is between two borders, the first of them included. Borders are exact
// where they have at most ten binary digits after the point: a centre is a ratio of whole numbers, and
// both sides of a comparison are then numbers below 2^53 in 2^-10, which float64 holds.

// theta_d is 90 m / n degrees.
bool theta_d_between(Voxel v, float from, float to) {
    float m = 90.0 * float(2 * v.theta_d_layer + 1);
    float n = float(2 * v.theta_d_layers);
    return m >= from * n && m < to * n;
}

// theta_h is 90 (m / n)^2 degrees.
bool theta_h_between(Voxel v, float from, float to) {
    float m = float(2 * v.theta_h_layer + 1);
    float n = float(2 * v.theta_h_layers);
    return 90.0 * m * m >= from * n * n && 90.0 * m * m < to * n * n;
}

// Counted in the 90 layers of theta_h that the grid of MERL has: the same M_t on every grid.
bool layer_between(Voxel v, float from, float to) {
    float m = 90.0 * float(2 * v.theta_h_layer + 1);
    float n = float(2 * v.theta_h_layers);
    return m >= from * n && m < to * n;
}
