// title: Ward's model, isotropic
// database: Ward fits of MERL (stand-in, not measured)
// formula: diffuse / pi + specular exp(-tan^2 theta_h / roughness^2) / (4 pi roughness^2 sqrt(cos theta_i cos theta_o))
// source: Ward, Measuring and Modeling Anisotropic Reflection, SIGGRAPH 1992
// table: fits of MERL by Ngan, Durand and Matusik, Experimental Analysis of BRDF Models, EGSR 2005
// parameter: vec3 diffuse albedo of the Lambertian part
// parameter: vec3 specular albedo of the lobe, nearly
// parameter: float roughness standard deviation of the slope of the surface

float of_theta_h(float theta_h) {
    float slope = tan(theta_h) / roughness;
    return exp(-slope * slope) / (4.0 * pi * roughness * roughness);
}

vec3 reflectance(Voxel v, float h) {
    return diffuse / pi + specular * (h / sqrt(v.cos_theta_i * v.cos_theta_o));
}
