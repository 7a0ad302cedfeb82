#pragma once

#include <memory>

#include "engine/distance/parts/engine.h"

namespace merl::engine {

/// Whether the host engine can compute a metric: whether it was compiled into the program.
inline bool host_can(const Metric& metric) {
    return metric.has_twin();
}

/// The engine on this processor: compiled for its widest vectors, without Vulkan.
std::unique_ptr<Engine> make_host_engine();

}  // namespace merl::engine
