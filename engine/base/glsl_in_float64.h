#pragma once

// What a GLSL file needs to be compiled as C++ in float64: GLM gives the types and functions of
// GLSL, shaders/lib/numerics.glsl is the same file. Included only by twin.h and model_twin.h, each
// of which the generated files of metrics or of models include, and which say that `float` means
// double in what follows.

#include <bit>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/exponential.hpp>
#include <glm/geometric.hpp>
#include <glm/mat2x2.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <glm/matrix.hpp>
#include <glm/trigonometric.hpp>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <glm/vec4.hpp>

#pragma GCC diagnostic ignored "-Wunused-parameter"
#pragma GCC diagnostic ignored "-Wunused-function"

namespace merl::engine::glsl {
namespace {

using namespace glm;  // the functions of GLSL
using single = float;
using vec2 = glm::dvec2;
using vec3 = glm::dvec3;
using vec4 = glm::dvec4;
using mat2 = glm::dmat2;
using mat3 = glm::dmat3;
using mat4 = glm::dmat4;

/// What numerics.glsl has for a double: 0x553e0000 less a third of the upper half of its bits. A
/// double has room for both halves as numbers, with which there are vector instructions.
double inverse_cube_root_seed(double x) {
    constexpr double kUnit = 0x1p52;  // plus a smaller whole number: that is in its lower bits
    const double upper =
        std::bit_cast<double>((std::bit_cast<std::uint64_t>(x) >> 32U) | 0x4330000000000000U);
    const double seed = upper * (-1.0 / 3) + (1.5 * kUnit + kUnit / 3 + 0x553e0000);
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(seed) << 32U);
}

#include "lib/numerics.glsl"

}  // namespace
}  // namespace merl::engine::glsl
