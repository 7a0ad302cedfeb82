// title: ABC microfacet model
// database: ABC fits of MERL (stand-in, not measured)
// formula: kd / pi + F G A / (1 + B (1 - cos theta_h))^C / (pi cos theta_i cos theta_o),
//   F the Fresnel term of ior at theta_d, G = min(1, 2 cos theta_h min(cos theta_i, cos theta_o) / cos theta_d)
// source: Löw, Kronander, Ynnerman and Unger, BRDF Models for Accurate and Efficient Rendering of Glossy Surfaces, ACM TOG 31(1), 2012
// table: fits of MERL by the authors, as tabulated in J. Dupuy's public-domain dj_brdf
// parameter: vec3 kd albedo of the Lambertian part
// parameter: vec3 A scale of the distribution, which is not normalised
// parameter: float B width of the distribution
// parameter: float C how fast the distribution falls off
// parameter: float ior index of refraction

float fresnel(float c) {
    float g = sqrt(ior * ior + c * c - 1.0);
    float s = (g - c) / (g + c);
    float p = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
    return 0.5 * s * s * (1.0 + p * p);
}

// The cosine, and the distribution.
vec2 of_theta_h(float theta_h) {
    float c = cos(theta_h);
    return vec2(c, 1.0 / pow(1.0 + B * (1.0 - c), C));
}

// The cosine, and the Fresnel term.
vec2 of_theta_d(float theta_d) {
    float c = cos(theta_d);
    return vec2(c, fresnel(c));
}

vec3 reflectance(Voxel v, vec2 h, vec2 d) {
    float masking = min(1.0, min(2.0 * h.x * v.cos_theta_i / d.x, 2.0 * h.x * v.cos_theta_o / d.x));
    float lobe = d.y * masking * h.y / (pi * v.cos_theta_i * v.cos_theta_o);
    return kd / pi + lobe * A;
}
