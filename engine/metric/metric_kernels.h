#pragma once

#include <cstdint>
#include <vector>

#include "engine/metric/metric.h"

namespace merl::engine {

/// The kernels of shaders/framework/ with one metric inside, as SPIR-V.
struct MetricKernels {
    std::vector<std::uint32_t> weigh, prepare;
    std::vector<std::uint32_t> difference;
    std::vector<std::uint32_t> norms;           // where has_norms()
    std::vector<std::uint32_t> ranges, slopes;  // where has_slopes()
    std::vector<std::uint32_t> check;           // where is_checked()
};

/// Compiles a metric. It sees no files but its own and those of shaders/lib/. Throws Error (input)
/// with the file's own line for what the compiler refuses, and for a function that is missing.
MetricKernels compile_kernels(const Metric& metric);

}  // namespace merl::engine
