// title: Blinn-Phong model, normalised
// database: Blinn-Phong fits of MERL (stand-in, not measured)
// formula: diffuse / pi + specular (exponent + 2) / (2 pi) cos^exponent theta_h
// source: Blinn, Models of Light Reflection for Computer Synthesized Pictures, SIGGRAPH 1977
// table: fits of MERL by Ngan, Durand and Matusik, Experimental Analysis of BRDF Models, EGSR 2005
// parameter: vec3 diffuse albedo of the Lambertian part
// parameter: vec3 specular scale of the lobe
// parameter: float exponent how narrow the lobe is

vec3 of_theta_h(float theta_h) {
    return diffuse / pi + specular * ((exponent + 2.0) / (2.0 * pi) * pow(cos(theta_h), exponent));
}

vec3 reflectance(Voxel v, vec3 h) { return h; }
