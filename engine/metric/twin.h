#pragma once

// Compiles a metric's GLSL file as C++ in float64. Included only by the generated file of each
// metric (twin.cpp.in).

#include "engine/base/glsl_in_float64.h"
#include "engine/base/widest_vectors.h"
#include "engine/metric/metric_library.h"

namespace merl::engine::glsl {
namespace {

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
