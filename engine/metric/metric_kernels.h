#pragma once

#include <cstdint>
#include <vector>

#include "engine/device/devices.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// The kernels of shaders/framework/ with one metric inside, as SPIR-V.
struct MetricKernels {
    std::vector<std::uint32_t> weigh, prepare;  // with float64
    std::vector<std::uint32_t> difference;
    std::vector<std::uint32_t> norms;           // where has_norms()
    std::vector<std::uint32_t> ranges, slopes;  // where has_slopes()
    std::vector<std::uint32_t> check;           // where is_checked()
    std::vector<std::uint32_t> degree;          // of these, where has_degree()
    // Of a summary these, and none of the others; feature where is_checked().
    std::vector<std::uint32_t> window = {}, window_parts = {}, window_sums = {}, feature = {};
};

/// Compiles a metric for a device whose shaders have these numbers. It sees no files but its own
/// and those of shaders/lib/. Throws Error (input) with the file's own line for what the compiler
/// refuses, and for a function that is missing. Without float64 the metric must have a twin, which
/// then makes the grid; and be no summary, which has nothing but float64.
MetricKernels compile_kernels(const Metric& metric,
                              const device::FloatControls& floats = {.float64 = true});

/// The kernels that compute single distances under a metric with a degree in float64:
/// shaders/framework/ weigh.comp, float64_grid.comp and float64_sums.comp. Errors as above; the
/// device must have float64.
struct Float64Kernels {
    std::vector<std::uint32_t> weigh, grid, sums;
};
Float64Kernels compile_float64_kernels(const Metric& metric, const device::FloatControls& floats);

/// The kernel `feature` of a summary alone.
std::vector<std::uint32_t> compile_feature(const Metric& metric,
                                           const device::FloatControls& floats);

}  // namespace merl::engine
