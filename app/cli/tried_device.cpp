#include "app/cli/tried_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <unistd.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include "app/cli/guard.h"
#include "app/cli/known_devices.h"
#include "app/cli/terminal.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"

namespace merl::app {
namespace {

using device::ContextOptions;
using device::DeviceInfo;
using device::Trial;
using Manifests = std::vector<std::string>;

/// The device that a program with these options would use, if any.
using Choose = std::function<std::optional<DeviceInfo>(const ContextOptions&)>;

/// The longest that a driver may take on a machine that has other things to do.
constexpr double kLoadSeconds = 60;
constexpr double kTrialSeconds = 300;
constexpr auto kAnyMemory = std::numeric_limits<std::uint64_t>::max();

std::string how_to_try_again() {
    const auto file = known_devices_file();
    return file.empty() ? "" : fmt::format(" (remove {} to try it again)", file.string());
}

/// What the environment has to be for these drivers alone.
Variables variables_for(const Manifests& manifests) {
    const auto text =
        manifests.empty() ? "/dev/null" : fmt::format("{}", fmt::join(manifests, ":"));
    return {{"VK_DRIVER_FILES", text},
            {"VK_ICD_FILENAMES", text},  // what older loaders read
            {"VK_ADD_DRIVER_FILES", std::nullopt}};
}

/// Whether drivers can be loaded: those of the environment, or only some.
bool can_load(const std::optional<Manifests>& only) {
    try {
        ask_guarded("a Vulkan driver", kLoadSeconds, kAnyMemory, {},
                    only ? variables_for(*only) : Variables());
        return true;
    } catch (const InputError&) {  // it crashed, or did not end
        return false;
    }
}

Manifests without(const Manifests& all, const Manifests& some) {
    Manifests rest;
    std::ranges::copy_if(all, std::back_inserter(rest), [&](const auto& manifest) {
        return std::ranges::find(some, manifest) == some.end();
    });
    return rest;
}

/// Those that crash when they are loaded; nothing where all can be.
std::optional<Manifests> crashing(const Manifests& all) {
    if (can_load(std::nullopt)) {
        return std::nullopt;
    }
    Manifests found;
    std::ranges::copy_if(all, std::back_inserter(found),
                         [](const auto& manifest) { return !can_load(Manifests{manifest}); });
    return can_load(without(all, found)) ? found : all;  // some only together
}

/// All that decides which drivers are loaded, and that a new version of one changes.
std::string fingerprint(const Manifests& manifests) {
    std::string text;
    for (char** variable = environ; *variable != nullptr; ++variable) {
        const std::string_view setting = *variable;
        for (const auto* prefix : {"VK_", "XDG_CONFIG", "XDG_DATA", "HOME=", "RADV_", "MESA_",
                                   "LP_", "GALLIUM_", "INTEL_", "ANV_", "NV", "__"}) {
            if (setting.starts_with(prefix)) {
                text += fmt::format("{}\n", setting);
            }
        }
    }
    for (const auto& manifest : manifests) {
        std::error_code none;
        text += fmt::format(
            "{} {} {}\n", manifest, std::filesystem::file_size(manifest, none),
            std::filesystem::last_write_time(manifest, none).time_since_epoch().count());
    }
    return hash_of(text);
}

/// Leaves drivers out that crash. Where there is little memory any may, and nothing is learned.
void leave_out_crashing(KnownDevices& known, bool one_is_needed) {
    Manifests all;
    for (const auto& manifest : device::driver_manifests()) {
        all.push_back(manifest.string());
    }
    const auto now = fingerprint(all);
    if (!known.drivers.contains(now)) {
        if (memory_is_limited()) {
            return;
        }
        known.drivers[now] = crashing(all);
        keep_known_devices(known);
    }
    const auto& left_out = known.drivers[now];
    if (!left_out) {
        return;
    }
    const auto text =
        left_out->empty()
            ? std::string(
                  "a Vulkan driver crashes when it is loaded, and only those are used that "
                  "are installed where packages put them")
            : fmt::format("the Vulkan driver {} crashes when it is loaded, and is left out",
                          fmt::join(*left_out, ", "));
    const auto rest = without(all, *left_out);
    if (rest.empty() && one_is_needed) {
        throw Error(Fault::device,
                    fmt::format("{}{}; there is no other", text, how_to_try_again()));
    }
    print_warning(text + how_to_try_again());
    set_variables(variables_for(rest));
}

/// What comes of trying a device, and whether that will be the same next time: not where memory or
/// the device was lost on the way.
struct Outcome {
    Trial trial;
    bool is_for_good = true;
};

Outcome try_once(const DeviceInfo& device) {
    Outcome outcome;
    try {
        outcome.trial = trial_of_text(
            ask_guarded("trying it", kTrialSeconds, kAnyMemory, {std::to_string(device.index)}));
    } catch (const Error& error) {
        outcome.is_for_good = error.fault() == Fault::input;
        outcome.trial.refusal = outcome.is_for_good
                                    ? "its driver crashed or did not end when it was tried"
                                    : error.what();
    }
    outcome.trial.device = device::identity(device);
    if (outcome.is_for_good && !outcome.trial.refusal.empty()) {
        outcome.trial.refusal += how_to_try_again();
    }
    return outcome;
}

/// Where the memory of this process is limited drivers may crash instead of saying so: there the
/// device is opened in a process of its own each time.
void open_within_limits(const ContextOptions& options, const Choose& choose) {
    try {
        run_guarded("opening the device", kLoadSeconds, kAnyMemory, [&] {
            // What this process has taken by the time that it opens the device.
            const std::vector<std::byte> reserve(std::size_t{64} << 20U);
            if (choose(options)) {
                const device::Context context(options);
            }
        });
    } catch (const Error& error) {
        if (error.fault() == Fault::input) {  // it crashed, or never ended
            throw Error(Fault::resource,
                        "the Vulkan driver crashes within the memory that this process may have "
                        "(ulimit -v, -d); raise the limit");
        }
        throw;
    }
}

/// Tries the device that is chosen until that is one which is known. The last call of `choose` is
/// the one that counts.
void try_chosen(const std::string& device, bool one_is_needed, const pipeline::Control& control,
                const Choose& choose) {
    KnownDevices known = read_known_devices();
    leave_out_crashing(known, one_is_needed);
    ContextOptions options = {.device = device, .cache_directory = cache_directory()};
    options.trials = known.trials;
    if (memory_is_limited()) {
        open_within_limits(options, choose);
        choose(options);
        return;
    }
    for (;;) {
        const auto chosen = choose(options);
        if (!chosen || device::trial_of(*chosen, options.trials) != nullptr) {
            return;
        }
        control.update(fmt::format("trying {}", chosen->name), 0);
        const auto [trial, is_for_good] = try_once(*chosen);
        if (is_for_good) {
            known.trials.push_back(trial);
            keep_known_devices(known);
        } else if (!device.empty()) {
            return;  // it was asked for, and will say by itself what is wrong
        }
        options.trials.push_back(trial);
    }
}

}  // namespace

ContextOptions untried_device(const std::string& device) {
    ContextOptions options = {.device = device, .cache_directory = cache_directory()};
    if (device != engine::kHost) {
        KnownDevices known = read_known_devices();
        leave_out_crashing(known, !device.empty());
        options.trials = known.trials;
        for (auto& trial : options.trials) {
            trial.refusal.clear();
        }
    }
    return options;
}

std::unique_ptr<engine::Engines> tried_engines(const std::string& device,
                                               std::span<const engine::Metric* const> metrics,
                                               const pipeline::Control& control) {
    std::unique_ptr<engine::Engines> engines;
    const auto choose = [&](const ContextOptions& options) {
        engines = std::make_unique<engine::Engines>(options);
        return engines->device_for(metrics);
    };
    if (device == engine::kHost) {
        choose({.device = device});
        return engines;
    }
    const bool one_is_needed =
        !device.empty() ||
        std::ranges::any_of(metrics, [](const auto* metric) { return !metric->has_twin(); });
    try_chosen(device, one_is_needed, control, choose);
    return engines;
}

ContextOptions tried_device(const std::string& device, const pipeline::Control& control) {
    ContextOptions last;
    try_chosen(device, true, control, [&](const ContextOptions& options) {
        last = options;
        const auto devices = device::list_devices(options.trials);
        return std::optional(devices[device::choose_device(devices, options.device)]);
    });
    return last;
}

}  // namespace merl::app
