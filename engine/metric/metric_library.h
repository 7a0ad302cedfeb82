#pragma once

#include <span>
#include <string_view>

#include "engine/device/shader_compiler.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// A metric file that the build put into the program (shaders/twins.cmake).
struct BuiltMetric {
    std::string_view name;
    std::string_view source;
    MetricTwin twin;
};

/// The files of shaders/metrics/ and of shaders/verify/, by name.
std::span<const BuiltMetric> built_metrics();
std::span<const BuiltMetric> built_framework_test_metrics();

/// The files of shaders/framework/, shaders/lib/ and shaders/render/, named as in `#include`:
/// "lib/cielab.glsl".
std::span<const device::ShaderText> shader_files();

}  // namespace merl::engine
