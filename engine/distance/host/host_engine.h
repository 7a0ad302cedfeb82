#pragma once

#include <memory>

#include "engine/distance/parts/engine.h"

namespace merl::engine {

/// Whether the host engine can compute a metric: whether it was compiled into the program.
inline bool host_can(const Metric& metric) {
    return metric.has_twin();
}

/// Whether it does that well: a metric without a bound takes it minutes where a device, even a
/// software device, takes one.
inline bool host_is_fast_for(const Metric& metric) {
    return metric.has_twin() && metric.has_bound();
}

/// The engine on this processor: compiled for its widest vectors, without Vulkan.
std::unique_ptr<Engine> make_host_engine();

}  // namespace merl::engine
