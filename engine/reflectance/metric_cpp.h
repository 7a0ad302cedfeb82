#pragma once

// Compiles a metric's GLSL file as C++ in float64. Included only by the generated file of each
// metric (metric.cpp.in): GLM gives the types and functions of GLSL, shaders/lib/numerics.glsl is
// the same file, and `float` means double in what follows.

#include <cmath>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#include "engine/reflectance/metric.h"
#include "engine/widest_vectors.h"

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-function"

namespace merl::reflectance::glsl {
namespace {

using namespace glm;  // the functions of GLSL
using vec2 = glm::dvec2;
using vec3 = glm::dvec3;
using vec4 = glm::dvec4;

#include "lib/numerics.glsl"

}  // namespace
}  // namespace merl::reflectance::glsl

#define float double
