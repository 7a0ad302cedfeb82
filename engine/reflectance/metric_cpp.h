#pragma once

// Compiles a metric's GLSL file as C++ in float64. Included only by the generated file of each
// metric (engine/reflectance/metric.cpp.in): GLM gives the vector types, this file the functions of
// shaders/lib/numerics.glsl in double precision, and `float` means double in what follows.

#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "engine/reflectance/metric.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-function"

namespace merl::reflectance::glsl {

using namespace glm;  // the functions of GLSL
using vec2 = glm::dvec2;
using vec3 = glm::dvec3;
using vec4 = glm::dvec4;

inline double cube_root(double x) {
    return std::cbrt(x);
}

inline double two_thirds_power(double d) {
    const double root = std::cbrt(d);
    return root * root;
}

inline vec3 to_vec3(const Rgb& rgb) {
    return {rgb[0], rgb[1], rgb[2]};
}

}  // namespace merl::reflectance::glsl

#define float double
