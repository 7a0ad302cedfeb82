// title: Shifted gamma distribution (SGD)
// database: SGD fits of MERL (stand-in, not measured)
// formula: max(0, diffuse / pi + specular D F G(theta_i) G(theta_o) / (pi cos theta_i cos theta_o)),
//   t = alpha + tan^2 theta_h / alpha, D = k_n exp(-t) / (t^p pi cos^4 theta_h),
//   F = f0 + (1 - f0) (1 - cos theta_d)^5 - f1 cos theta_d,
//   G(theta) = 1 + lambda (1 - exp(c (theta - theta_0)^k)) for theta > theta_0 and 1 below, all for each channel
// source: Bagher, Soler and Holzschuch, Accurate Fitting of Measured Reflectances Using a Shifted Gamma Micro-facet
//   Distribution, Computer Graphics Forum 31(4), 2012
// table: fits of MERL by the authors
// slow: twelve powers and exponentials for each voxel
// parameter: vec3 diffuse albedo of the Lambertian part
// parameter: vec3 specular scale of the lobe
// parameter: vec3 alpha width of the distribution
// parameter: vec3 p its shape
// parameter: vec3 f0 reflectance of the Fresnel term at theta_d = 0, before f1
// parameter: vec3 f1 correction of the Fresnel term
// parameter: vec3 k_n normalisation of the distribution
// parameter: vec3 lambda scale of the shadowing
// parameter: vec3 c how strong the shadowing is
// parameter: vec3 k how late it sets in
// parameter: vec3 theta_0 where it sets in, radians

vec3 of_theta_h(float theta_h) {
    float slope = tan(theta_h);
    float cosine = cos(theta_h);
    vec3 t = alpha + slope * slope / alpha;
    return k_n * exp(-t) / (pow(t, p) * pi * (cosine * cosine * cosine * cosine));
}

vec3 of_theta_d(float theta_d) {
    float cosine = cos(theta_d);
    return f0 + (vec3(1.0) - f0) * pow(1.0 - cosine, 5.0) - f1 * cosine;
}

// 1 - exp(c x^k) of one channel; 0 where shadowing has not set in.
float shadow(float theta, float c_1, float k_1, float theta_0_1) {
    return theta > theta_0_1 ? 1.0 - exp(c_1 * pow(theta - theta_0_1, k_1)) : 0.0;
}

vec3 shadowing(float cosine) {
    float theta = acos(cosine);
    return vec3(1.0) + lambda * vec3(shadow(theta, c.x, k.x, theta_0.x), shadow(theta, c.y, k.y, theta_0.y),
                                     shadow(theta, c.z, k.z, theta_0.z));
}

vec3 reflectance(Voxel v, vec3 distribution, vec3 fresnel) {
    vec3 lobe = distribution * fresnel * shadowing(v.cos_theta_i) * shadowing(v.cos_theta_o);
    vec3 f = diffuse / pi + specular * lobe / (pi * v.cos_theta_i * v.cos_theta_o);
    return max(f, vec3(0.0));
}
