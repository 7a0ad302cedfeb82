#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/device/context.h"
#include "engine/distance/parts/engine.h"
#include "engine/metric/metric.h"

namespace merl::engine {

/// What Engines calls the processor without Vulkan.
inline constexpr const char* kHost = "host";

/// Which engine computes which metric.
///
/// Without a choice: on a GPU the Vulkan engine, everything. Without one the host engine; what it
/// cannot do well (a user's metric; one without a degree, whose twin is slow) goes to a software
/// device if there is one. With kHost the host engine alone, with a Vulkan device that device
/// alone, whose shaders then compute everything. A user's metric needs float64 in shaders.
class Engines {
  public:
    /// `device` is empty, kHost, or an index or a part of the name of a Vulkan device. Nothing is
    /// opened yet.
    explicit Engines(std::string device = {});

    /// A Vulkan device that is open already, which outlives this: for everything, or for what the
    /// host engine cannot do well.
    enum class Use { everything, rest };
    explicit Engines(device::Context& context, Use use = Use::everything);

    /// An engine, and the metrics that it is to compute, by their place in the list.
    struct Share {
        Engine* engine;
        std::vector<std::size_t> metrics;
    };

    /// Distributes metrics, devices before the host. Opens the device that it needs, if any. What
    /// the user should know goes to `warnings`. Throws Error (device) when a metric needs a device
    /// and there is none that can be used, (usage) when the host engine was chosen for a metric
    /// that it cannot compute.
    std::vector<Share> share(std::span<const Metric* const> metrics,
                             std::vector<std::string>& warnings);

  private:
    enum class Rule { automatic, host, vulkan };

    /// Opens the device unless it is open.
    Engine& vulkan();
    void find_devices();
    [[noreturn]] void refuse(const Metric& metric) const;
    [[noreturn]] void refuse_without_float64(const Metric& metric) const;

    std::string device_;
    Rule rule_;
    bool looked_ = false;        // for devices
    bool software_ = false;      // whether there is a usable device, and it is the processor
    std::string why_no_device_;  // where none can be used
    bool no_driver_ = false;     // for want of a driver that could be installed
    std::optional<device::Context> context_;
    const device::Context* opened_ = nullptr;
    std::unique_ptr<Engine> host_;
    std::unique_ptr<Engine> vulkan_;
};

}  // namespace merl::engine
