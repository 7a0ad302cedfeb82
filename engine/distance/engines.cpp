#include "engine/distance/engines.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "engine/base/error.h"
#include "engine/distance/float64_distances.h"
#include "engine/distance/host/host_engine.h"
#include "engine/distance/vulkan/vulkan_engine.h"
#include "engine/distance/vulkan/vulkan_float64.h"

namespace merl::engine {

Engines::Engines(device::ContextOptions options)
    : options_(std::move(options)),
      rule_(options_.device.empty()    ? Rule::automatic
            : options_.device == kHost ? Rule::host
                                       : Rule::vulkan),
      host_(make_host_engine()) {}

Engines::Engines(device::Context& context, Use use)
    : rule_(use == Use::everything ? Rule::vulkan : Rule::automatic),
      looked_(true),
      chosen_(context.info()),
      rest_only_(use == Use::rest),
      open_(&context),
      host_(make_host_engine()),
      vulkan_(make_vulkan_engine(context)) {}

device::Context& Engines::context() {
    if (open_ == nullptr) {
        context_.emplace(options_);
        chosen_ = context_->info();
        open_ = &*context_;
    }
    return *open_;
}

Engine& Engines::vulkan() {
    if (!vulkan_) {
        vulkan_ = make_vulkan_engine(context());
    }
    return *vulkan_;
}

/// The device, and where nothing was asked for what it is to compute.
void Engines::choose() {
    if (rule_ == Rule::host || std::exchange(looked_, true)) {
        return;
    }
    try {
        const auto devices = device::list_devices(options_.trials);
        for (const auto& device : devices) {
            const auto* const trial = device::trial_of(device, options_.trials);
            if (rule_ == Rule::automatic && trial != nullptr && !trial->refusal.empty()) {
                failed_.push_back(fmt::format("{} is not used: {}", device.name, trial->refusal));
            }
        }
        chosen_ = devices[device::choose_device(devices, options_.device)];
        const auto* const trial = device::trial_of(*chosen_, options_.trials);
        rest_only_ =
            rule_ == Rule::automatic && (chosen_->limits.is_host || !chosen_->is_conformant ||
                                         (trial != nullptr && trial->loses_to_host));
    } catch (const device::NoDriverError& error) {
        why_no_device_ = error.what();
        no_driver_ = !error.is_installed();
    } catch (const Error& error) {
        why_no_device_ = error.what();
    }
}

/// After choose(). A device that was asked for and is not there fails when it is opened.
bool Engines::is_for_device(const Metric& metric) const {
    if (metric.is_summary() && metric.has_twin() && chosen_ && !chosen_->limits.floats.float64) {
        return false;  // there is nothing in it but float64
    }
    return rule_ == Rule::vulkan || (chosen_ && !(rest_only_ && host_can(metric)));
}

std::optional<device::DeviceInfo> Engines::device_for(std::span<const Metric* const> metrics) {
    choose();
    const bool opens =
        std::ranges::any_of(metrics, [&](const Metric* metric) { return is_for_device(*metric); });
    return opens ? chosen_ : std::nullopt;
}

void Engines::refuse(const Metric& metric) const {
    const auto text = fmt::format(
        "{}: the shaders of one's own metric need a Vulkan device{}", metric.file,
        rule_ == Rule::host ? fmt::format(", which {} is not", kHost) : ": " + why_no_device_);
    if (rule_ == Rule::host) {
        throw Error(Fault::usage, text);
    }
    throw device::NoDriverError(text, !no_driver_);
}

void Engines::refuse_without_float64(const Metric& metric) const {
    const auto devices = device::list_devices(options_.trials);
    const auto other = std::ranges::find_if(
        devices, [](const device::DeviceInfo& d) { return !d.refusal && d.limits.floats.float64; });
    throw Error(Fault::device,
                fmt::format("{}: one's own metric computes in float64, which {} does "
                            "not have in shaders: {}",
                            metric.file, chosen_->name,
                            other == devices.end()
                                ? "no other Vulkan device of this machine has it; Mesa's lavapipe "
                                  "does (on Debian: apt-get "
                                  "install mesa-vulkan-drivers)"
                                : fmt::format("choose one that does, as with --device {} ({})",
                                              other->index, other->name)));
}

std::vector<Engines::Share> Engines::share(std::span<const Metric* const> metrics,
                                           std::vector<std::string>& warnings) {
    choose();
    warnings.insert(warnings.end(), failed_.begin(), failed_.end());
    std::vector<std::size_t> on_device;
    std::vector<std::size_t> on_host;
    for (std::size_t m = 0; m < metrics.size(); ++m) {
        const Metric& metric = *metrics[m];
        if (is_for_device(metric)) {
            on_device.push_back(m);
            continue;
        }
        if (!host_can(metric)) {
            refuse(metric);
        }
        on_host.push_back(m);
    }
    std::vector<Share> shares;
    if (!on_device.empty()) {
        shares.push_back({&vulkan(), std::move(on_device)});
        for (const auto m : shares.back().metrics) {
            if (!chosen_->limits.floats.float64 && !metrics[m]->has_twin()) {
                refuse_without_float64(*metrics[m]);
            }
        }
    }
    if (!on_host.empty()) {
        shares.push_back({host_.get(), std::move(on_host)});
    }
    return shares;
}

std::vector<std::vector<double>> Engines::float64_distances(
    const Database& database, std::span<const Float64Request> requests,
    const std::function<void(double)>& progress, std::uint64_t memory_bytes) {
    std::vector<Float64Request> on_host;
    std::vector<Float64Pairs> on_device;
    double host_pairs = 0;
    double pairs = 0;
    for (const auto& request : requests) {
        const auto count = static_cast<double>(request.pairs.size());
        pairs += count;
        if (request.metric->has_twin()) {
            on_host.push_back(request);
            host_pairs += count;
        } else {
            on_device.push_back({request.metric, request.pairs});
        }
    }
    const auto part_of = [&](double from, double size) {
        return [=, &progress](double share) {
            if (progress) {
                progress((from + share * size) / pairs);
            }
        };
    };
    std::vector<std::vector<double>> of_host;
    if (host_pairs > 0) {
        of_host = engine::float64_distances(database, on_host, VoxelSet::above_horizon,
                                            part_of(0, host_pairs), memory_bytes);
    } else {
        of_host.resize(on_host.size());
    }
    std::vector<std::vector<double>> of_device(on_device.size());
    if (pairs > host_pairs) {
        choose();
        if (!chosen_) {
            refuse(*on_device.front().metric);
        }
        auto& device = context();
        if (!chosen_->limits.floats.float64) {
            refuse_without_float64(*on_device.front().metric);
        }
        of_device = vulkan_float64_distances(device, database, on_device, VoxelSet::above_horizon,
                                             part_of(host_pairs, pairs - host_pairs), memory_bytes);
    }
    std::vector<std::vector<double>> result;
    auto next_of_host = of_host.begin();
    auto next_of_device = of_device.begin();
    for (const auto& request : requests) {
        result.push_back(
            std::move(request.metric->has_twin() ? *next_of_host++ : *next_of_device++));
    }
    return result;
}

}  // namespace merl::engine
