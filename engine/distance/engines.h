#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "engine/database/database.h"
#include "engine/device/context.h"
#include "engine/distance/parts/engine.h"
#include "engine/metric/metric.h"

namespace merl::engine {

struct Float64Request;  // float64_distances.h

/// What Engines calls the processor without Vulkan.
inline constexpr const char* kHost = "host";

/// Which engine computes which metric.
///
/// Without a choice: on a GPU the Vulkan engine, everything. Without one, where its driver is not
/// conformant, or where a trial says that it is slower than the processor, the host engine; what
/// that cannot do, a user's metric, goes to the device that there is. With kHost the host engine
/// alone, with a Vulkan device that device alone, whose shaders then compute everything. A user's
/// metric needs float64 in shaders.
class Engines {
  public:
    /// `options.device` may be kHost too. Nothing is opened yet.
    explicit Engines(device::ContextOptions options = {});

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

    /// Distances in float64 of some pairs under metrics that can be refined
    /// (Metric::can_be_refined): those with a twin on the host (float64_distances.h, also for what
    /// is promised of progress and memory), those without on the device that computes them
    /// (vulkan/vulkan_float64.h), which it opens if it is not open. Throws what these throw, and
    /// what share() throws where there is no such device.
    std::vector<std::vector<double>> float64_distances(const Database& database,
                                                       std::span<const Float64Request> requests,
                                                       const std::function<void(double)>& progress,
                                                       std::uint64_t memory_bytes);

    /// The Vulkan device that share() would open; none where it opens none, or cannot. Looks for
    /// devices, which share() then need not.
    std::optional<device::DeviceInfo> device_for(std::span<const Metric* const> metrics);

    /// What it was made of; nothing where that was a device.
    const device::ContextOptions& options() const { return options_; }

  private:
    enum class Rule { automatic, host, vulkan };

    /// Opens the device unless it is open.
    Engine& vulkan();
    device::Context& context();
    void choose();
    bool is_for_device(const Metric& metric) const;
    [[noreturn]] void refuse(const Metric& metric) const;
    [[noreturn]] void refuse_without_float64(const Metric& metric) const;

    device::ContextOptions options_;
    Rule rule_;
    bool looked_ = false;                       // for devices
    std::optional<device::DeviceInfo> chosen_;  // not opened yet, or by this
    bool rest_only_ = false;           // whether it is for what the host engine cannot do well
    std::string why_no_device_;        // where none can be used
    std::vector<std::string> failed_;  // devices that a trial refused, and why
    bool no_driver_ = false;           // for want of a driver that could be installed
    std::optional<device::Context> context_;  // that this opened
    device::Context* open_ = nullptr;         // this, or one that was open already
    std::unique_ptr<Engine> host_;
    std::unique_ptr<Engine> vulkan_;
};

}  // namespace merl::engine
