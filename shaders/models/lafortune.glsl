// title: Lafortune's model, isotropic with one lobe
// database: Lafortune fits of MERL (stand-in, not measured)
// formula: diffuse / pi + specular (exponent + 2) / (2 pi)
//   (max(0, c_xy (i_x o_x + i_y o_y) + c_z cos theta_i cos theta_o) / max(|c_xy|, |c_z|))^exponent
// source: Lafortune, Foo, Torrance and Greenberg, Non-Linear Approximation of Reflectance Functions, SIGGRAPH 1997
// table: fits of MERL by Ngan, Durand and Matusik, Experimental Analysis of BRDF Models, EGSR 2005
// parameter: vec3 diffuse albedo of the Lambertian part
// parameter: vec3 specular scale of the lobe
// parameter: float c_xy what the directions' parts along the surface count
// parameter: float c_z what their parts along the normal count
// parameter: float exponent how narrow the lobe is

// The dot product of i and o: the angle between them is twice theta_d.
float of_theta_d(float theta_d) { return cos(2.0 * theta_d); }

vec3 reflectance(Voxel v, float dot_i_o) {
    float along_normal = v.cos_theta_i * v.cos_theta_o;
    float lobe = max(c_xy * (dot_i_o - along_normal) + c_z * along_normal, 0.0) / max(abs(c_xy), abs(c_z));
    return diffuse / pi + specular * ((exponent + 2.0) / (2.0 * pi) * pow(lobe, exponent));
}
