#pragma once

// Compiles a metric's GLSL file as C++ in float64. Included only by the generated file of each
// metric (twin.cpp.in): GLM gives the types and functions of GLSL, shaders/lib/numerics.glsl is
// the same file, and `float` means double in what follows.

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

#include "engine/base/widest_vectors.h"
#include "engine/metric/metric_library.h"

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

/// The transformed sample at k.
template <typename Chosen>
vec3 transform_of(Chosen& chosen, std::span<const Voxel, kBlockVoxels> voxels,
                  const BlockSamples& samples, std::size_t k) {
    return chosen.transform(vec3(samples[0][k], samples[1][k], samples[2][k]), voxels[k]);
}

/// The weight of a voxel in a window, of a metric that has windows.
template <typename Chosen>
double window_of(Chosen& chosen, std::uint32_t window, const Voxel& voxel) {
    if constexpr (requires { chosen.window(0, voxel); }) {
        return chosen.window(static_cast<int>(window), voxel);
    } else {
        return 0;
    }
}

/// The difference of the samples at k, in either of its two forms.
template <typename Chosen>
double difference_of(Chosen& chosen, const BlockSamples& a, const BlockSamples& b, std::size_t k) {
    if constexpr (requires { chosen.difference(0.0); }) {
        return chosen.difference(a[0][k] - b[0][k]) + chosen.difference(a[1][k] - b[1][k]) +
               chosen.difference(a[2][k] - b[2][k]);
    } else {
        return chosen.difference(vec3(a[0][k], a[1][k], a[2][k]), vec3(b[0][k], b[1][k], b[2][k]));
    }
}

}  // namespace
}  // namespace merl::engine::glsl

#define float double
#define precise
