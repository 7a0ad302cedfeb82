#pragma once

// What a GLSL file needs to be compiled as C++ in float32, for the sums of a metric without a
// degree. GLM gives the types and functions of GLSL; exp, sin and atan are here without a branch or
// a call, so that a loop over them becomes vectors. They take and give finite numbers. Included
// only by single_twin.h, whose files are compiled with unsuffixed literals as float32
// (shaders/twins.cmake).

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
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wfloat-conversion"

namespace merl::engine::glsl::float32 {
namespace {

using namespace glm;  // the functions of GLSL
using glm::max;
using glm::min;
using vec2 = glm::vec2;
using vec3 = glm::vec3;
using vec4 = glm::vec4;
using mat2 = glm::mat2;
using mat3 = glm::mat3;
using mat4 = glm::mat4;

float max(float a, float b) {
    return a < b ? b : a;
}
float min(float a, float b) {
    return b < a ? b : a;
}

constexpr float kRounds = 0x1.8p23F;  // plus a number below 2^22: that to the nearest whole one

/// e^x, relative error below 4e-7; what would be below e^-87 is that, what would be above e^88 too.
/// x = n ln 2 + f, and a minimax polynomial of degree 5 for e^f.
float exp(float x) {
    x = min(max(x, -87.0F), 88.0F);
    const float shifted = x * 1.44269504F + kRounds;
    const float n = shifted - kRounds;
    float f = x - n * 0x1.63p-1F;  // the upper digits of ln 2,
    f += n * 2.12194440e-4F;       // and the rest
    float p = 0.00831243F;
    p = p * f + 0.04189099F;
    p = p * f + 0.16667118F;
    p = p * f + 0.49999226F;
    const float power = std::bit_cast<float>(
        (std::bit_cast<std::int32_t>(shifted) - std::bit_cast<std::int32_t>(kRounds) + 127) << 23);
    return (f * f * p + f + 1.0F) * power;
}

/// sin x, absolute error below 3e-7 for |x| up to 1000: x less a multiple of pi, and a minimax
/// polynomial of degree 9.
float sin(float x) {
    const float shifted = x * 0.318309886F + kRounds;
    const float n = shifted - kRounds;
    float r = x - n * 3.140625F;        // the upper digits of pi,
    r -= n * 9.67502593994140625e-4F;   // the next,
    r -= n * 1.509957990978376432e-7F;  // and the rest
    const float z = r * r;
    float p = 2.60005451e-6F;
    p = p * z - 1.98066151e-4F;
    p = p * z + 8.33301729e-3F;
    p = p * z - 0.166666571F;
    const float sine = r + r * z * p;
    return (std::bit_cast<std::int32_t>(shifted) & 1) != 0 ? -sine : sine;
}

/// The angle of (x, y), absolute error below 5e-7; 0 for (0, 0). The smaller over the larger of
/// both, and a minimax polynomial of degree 15.
float atan(float y, float x) {
    const float of_x = x < 0 ? -x : x;
    const float of_y = y < 0 ? -y : y;
    const float t = min(of_x, of_y) / max(max(of_x, of_y), 1e-30F);
    const float z = t * t;
    float p = -0.00435540F;
    p = p * z + 0.02304010F;
    p = p * z - 0.05777355F;
    p = p * z + 0.09794232F;
    p = p * z - 0.13976581F;
    p = p * z + 0.19962704F;
    p = p * z - 0.33331659F;
    float angle = t + t * z * p;
    angle = of_y > of_x ? 1.57079632679F - angle : angle;
    angle = x < 0 ? 3.14159265359F - angle : angle;
    return y < 0 ? -angle : angle;
}

float atan(float x) {
    return std::atan(x);
}

// Of each component, as GLM has them.
template <length_t Length>
auto exp(const vec<Length, float>& x) {
    return glm::exp(x);
}
template <length_t Length>
auto sin(const vec<Length, float>& x) {
    return glm::sin(x);
}
template <length_t Length>
auto atan(const vec<Length, float>& x) {
    return glm::atan(x);
}
template <length_t Length>
auto atan(const vec<Length, float>& y, const vec<Length, float>& x) {
    return glm::atan(y, x);
}

#include "lib/numerics.glsl"

}  // namespace
}  // namespace merl::engine::glsl::float32
