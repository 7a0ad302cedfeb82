#version 460

// A unit sphere of one material, seen by a perspective camera on the +z axis and lit from one direction:
// linear radiance in red, green and blue, and the share of the pixel that the sphere covers.

layout(local_size_x = 8, local_size_y = 8) in;

layout(binding = 0) uniform samplerBuffer brdf;                         // [theta_h][theta_d][phi_d], 1/sr, none negative
layout(std430, binding = 1) writeonly buffer Pixels { vec4 pixels[]; };  // rows from the top

layout(push_constant) uniform Push {
    uvec3 grid;           // voxels along phi_d, theta_d, theta_h
    uint size;            // of the image, in pixels
    vec3 light;           // unit vector towards the light
    float tangent;        // of half the field of view
    float camera;         // where on the z axis
    float phi_range;      // where phi_d ends: pi or 2 pi
};

const float kPi = 3.14159265358979;
// Samples of a pixel are side x side: many where the silhouette crosses it, few where only shading changes.
const int kEdgeSide = 4;
const int kInnerSide = 2;

/// A row of the two voxels beside M_r, which repeats.
vec3 along_phi(uint row, uint low, uint high, float share) {
    int first = int(row * grid.x);
    return mix(texelFetch(brdf, first + int(low)).rgb, texelFetch(brdf, first + int(high)).rgb, share);
}

/// Trilinear in M_r, M_s and M_t between voxel centres; before the first centre of M_s and M_t, and beyond the last, constant.
vec3 look_up(vec3 m) {
    vec3 at = m * vec3(grid) - 0.5;
    at.yz = clamp(at.yz, vec2(0.0), vec2(grid.yz) - 1.0);
    vec3 base = floor(at);
    vec3 share = at - base;
    // M_r is in [0, 1]: base.x is from -1 to grid.x - 1.
    uint r0 = (uint(int(base.x) + int(grid.x))) % grid.x;
    uint r1 = (r0 + 1) % grid.x;
    uvec2 low = uvec2(base.yz);
    uvec2 high = min(low + 1, grid.yz - 1);
    vec3 near = mix(along_phi(low.y * grid.y + low.x, r0, r1, share.x),
                    along_phi(low.y * grid.y + high.x, r0, r1, share.x), share.y);
    vec3 far = mix(along_phi(high.y * grid.y + low.x, r0, r1, share.x),
                   along_phi(high.y * grid.y + high.x, r0, r1, share.x), share.y);
    return mix(near, far, share.z);
}

/// Reflected radiance at a point with normal `n` towards `eye`; nothing below the horizon.
vec3 radiance(vec3 n, vec3 eye) {
    float cos_theta_i = dot(n, light);
    if (cos_theta_i <= 0.0 || dot(n, eye) <= 0.0) {
        return vec3(0.0);
    }
    vec3 h = normalize(light + eye);
    // Half-difference coordinates (Rusinkiewicz 1998) in the frame (u, v, h). Arc tangents keep small angles exact.
    vec3 across = cross(n, h);
    float sin_theta_h = length(across);
    vec3 v = sin_theta_h > 0.0 ? across / sin_theta_h : normalize(cross(h, abs(h.x) < 0.5 ? vec3(1, 0, 0) : vec3(0, 1, 0)));
    vec3 u = cross(v, h);
    vec2 d = vec2(dot(light, u), dot(light, v));
    float theta_h = atan(sin_theta_h, dot(n, h));
    float theta_d = atan(length(d), dot(light, h));
    float phi_d = any(notEqual(d, vec2(0.0))) ? atan(d.y, d.x) : 0.0;
    if (phi_d < 0.0) {
        phi_d += phi_range;  // over pi, reciprocity: light and eye change places
    }
    return look_up(vec3(phi_d / phi_range, theta_d / (kPi / 2.0), sqrt(theta_h / (kPi / 2.0)))) * cos_theta_i;
}

/// The ray through a place of the image, in pixels.
vec3 ray_through(vec2 at) {
    vec2 screen = (2.0 * at / float(size) - 1.0) * tangent;
    return normalize(vec3(screen.x, -screen.y, -1.0));
}

/// Squared distance of the ray from the centre, below 1 where it hits; nothing cancels however far the camera is.
float distance2(vec3 ray) { return camera * camera * dot(ray.xy, ray.xy); }

void main() {
    uvec2 pixel = gl_GlobalInvocationID.xy;
    if (pixel.x >= size || pixel.y >= size) {
        return;
    }
    bool inner = true;
    for (int corner = 0; corner < 4; ++corner) {
        inner = inner && distance2(ray_through(vec2(pixel) + vec2(corner % 2, corner / 2))) < 1.0;
    }
    int side = inner ? kInnerSide : kEdgeSide;
    vec4 sum = vec4(0.0);
    for (int i = 0; i < side * side; ++i) {
        vec3 ray = ray_through(vec2(pixel) + (vec2(i % side, i / side) + 0.5) / float(side));
        float past = distance2(ray);
        if (past < 1.0) {
            vec3 nearest = camera * vec3(-ray.z * ray.xy, dot(ray.xy, ray.xy));
            sum += vec4(radiance(normalize(nearest - sqrt(1.0 - past) * ray), -ray), 1.0);
        }
    }
    pixels[pixel.y * size + pixel.x] = sum / float(side * side);
}
