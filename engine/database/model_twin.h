#pragma once

// Compiles a model's GLSL file as C++ in float64. Included only by the generated file of each model
// (model_twin.cpp.in).

#include <numbers>

#include "engine/base/glsl_in_float64.h"
#include "engine/database/model.h"

#pragma GCC diagnostic ignored "-Woverlength-strings"  // a table may be long

namespace merl::engine::glsl {
namespace {

constexpr double pi = std::numbers::pi;  // which every model may use

/// The reflectance of a model at voxels that share theta_h and theta_d: what depends on one of
/// these alone is computed once.
template <typename Chosen>
void evaluate(Chosen& chosen, std::span<const Voxel> voxels, std::span<double> red,
              std::span<double> green, std::span<double> blue) {
    constexpr bool has_theta_h = requires {
        chosen.of_theta_h(0.0);
    };
    constexpr bool has_theta_d = requires {
        chosen.of_theta_d(0.0);
    };
    const auto fill = [&](const auto&... terms) {
        for (std::size_t k = 0; k < voxels.size(); ++k) {
            const vec3 f = voxels[k].above_horizon() ? chosen.reflectance(voxels[k], terms...)
                                                     : vec3(0.0, 0.0, 0.0);
            red[k] = f.x;
            green[k] = f.y;
            blue[k] = f.z;
        }
    };
    const Voxel& v = voxels.front();
    if constexpr (has_theta_h && has_theta_d) {
        fill(chosen.of_theta_h(v.theta_h), chosen.of_theta_d(v.theta_d));
    } else if constexpr (has_theta_h) {
        fill(chosen.of_theta_h(v.theta_h));
    } else if constexpr (has_theta_d) {
        fill(chosen.of_theta_d(v.theta_d));
    } else {
        fill();
    }
}

}  // namespace
}  // namespace merl::engine::glsl

#define float double
