#include "app/cli/tried_device.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <limits>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "app/cli/guard.h"
#include "app/cli/terminal.h"
#include "app/pipeline/trial.h"
#include "app/pipeline/version.h"
#include "engine/base/error.h"
#include "engine/base/hash.h"
#include "engine/base/kept_file.h"
#include "engine/distance/engines.h"

namespace merl::app {
namespace {

using device::ContextOptions;
using device::DeviceInfo;
using device::Trial;

/// The longest that a driver may take on a machine that has other things to do.
constexpr double kLoadSeconds = 60;
constexpr double kTrialSeconds = 300;
constexpr auto kAnyMemory = std::numeric_limits<std::uint64_t>::max();

/// What is known, as it is kept in a file of the cache.
struct Known {
    nlohmann::json drivers = nlohmann::json::object();  // by fingerprint(): those that crash
    std::vector<Trial> trials = {};
};

std::filesystem::path known_file() {
    const auto directory = cache_directory();
    return directory.empty() ? directory : directory / "devices.json";
}

/// A driver may call its device anything.
std::string text_of(const nlohmann::json& json) {
    return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace);
}

nlohmann::json json_of(const Trial& trial) {
    nlohmann::json json = {{"device", trial.device},
                           {"refusal", trial.refusal},
                           {"loses_to_host", trial.loses_to_host}};
    if (trial.tiles) {
        json["tiles"] = {{"power", trial.tiles->power}, {"square", trial.tiles->square}};
    }
    return json;
}

Trial trial_of(const nlohmann::json& json) {
    Trial trial = {.device = json.at("device"),
                   .refusal = json.at("refusal"),
                   .loses_to_host = json.at("loses_to_host")};
    if (json.contains("tiles")) {
        trial.tiles = {.power = json["tiles"].at("power"), .square = json["tiles"].at("square")};
    }
    return trial;
}

Known read_known() {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 20U;
    Known known;
    const auto text = known_file().empty() ? std::nullopt : read_kept(known_file(), kMost);
    const auto json = nlohmann::json::parse(text.value_or(""), nullptr, false);
    if (json.is_discarded() || json.at("program") != pipeline::kVersion) {
        return known;
    }
    known.drivers = json.at("drivers");
    for (const auto& trial : json.at("trials")) {
        known.trials.push_back(trial_of(trial));
    }
    return known;
}

void keep_known(const Known& known) {
    if (known_file().empty()) {
        return;
    }
    auto trials = nlohmann::json::array();
    for (const auto& trial : known.trials) {
        trials.push_back(json_of(trial));
    }
    const nlohmann::json json = {
        {"program", pipeline::kVersion}, {"drivers", known.drivers}, {"trials", trials}};
    keep(known_file(), text_of(json));
}

/// Runs `work` in a process of its own. Returns whether it came to an end; what it throws there
/// will be thrown again where it is not tried but used.
bool survives(double seconds, const std::function<void()>& work) {
    try {
        run_guarded("a Vulkan driver", seconds, kAnyMemory, [&] {
            try {
                work();
            } catch (const std::exception&) {
                // Not what is asked here.
            }
        });
        return true;
    } catch (const InputError&) {
        return false;
    }
}

/// All that decides which drivers are loaded, and that a new version of one changes.
std::string fingerprint(const std::vector<std::filesystem::path>& manifests) {
    std::string text;
    for (const char* name :
         {"VK_DRIVER_FILES", "VK_ICD_FILENAMES", "VK_ADD_DRIVER_FILES", "VK_LOADER_DRIVERS_SELECT",
          "VK_LOADER_DRIVERS_DISABLE", "VK_INSTANCE_LAYERS", "VK_LAYER_PATH", "XDG_DATA_DIRS"}) {
        const char* const value = std::getenv(name);
        text += fmt::format("{}\n", value == nullptr ? "" : value);
    }
    for (const auto& manifest : manifests) {
        std::error_code none;
        text += fmt::format(
            "{} {} {}\n", manifest.string(), std::filesystem::file_size(manifest, none),
            std::filesystem::last_write_time(manifest, none).time_since_epoch().count());
    }
    return hash_of(text);
}

void load_only(const std::string& manifests) {
    ::setenv("VK_DRIVER_FILES", manifests.c_str(), /*overwrite=*/1);
    ::setenv("VK_ICD_FILENAMES", manifests.c_str(), /*overwrite=*/1);  // what older loaders read
}

const auto load_drivers = [] { device::list_devices(); };

/// Those that crash or hang when they are loaded.
std::vector<std::string> crashing(const std::vector<std::filesystem::path>& manifests) {
    std::vector<std::string> found;
    if (!survives(kLoadSeconds, load_drivers)) {
        for (const auto& manifest : manifests) {
            if (!survives(kLoadSeconds, [&] {
                    load_only(manifest.string());
                    load_drivers();
                })) {
                found.push_back(manifest.string());
            }
        }
    }
    return found;
}

/// Leaves drivers out that crash. Where there is little memory any may, and nothing is learned.
void leave_out_crashing(Known& known, bool one_is_needed) {
    auto manifests = device::driver_manifests();
    const auto now = fingerprint(manifests);
    if (!known.drivers.contains(now)) {
        if (memory_is_limited()) {
            return;
        }
        known.drivers[now] = crashing(manifests);
        keep_known(known);
    }
    const auto left_out = known.drivers[now].get<std::vector<std::string>>();
    if (left_out.empty()) {
        return;
    }
    const auto crashes = fmt::format(
        "the Vulkan driver {} crashes when it is loaded, and is left out (remove {} to try it "
        "again)",
        fmt::join(left_out, ", "), known_file().string());
    std::erase_if(manifests, [&](const auto& manifest) {
        return std::ranges::find(left_out, manifest.string()) != left_out.end();
    });
    if (manifests.empty() && one_is_needed) {
        throw Error(Fault::device, crashes + "; there is no other");
    }
    print_warning(crashes);
    std::vector<std::string> rest(manifests.size());
    std::ranges::transform(manifests, rest.begin(), [](const auto& m) { return m.string(); });
    load_only(rest.empty() ? "/dev/null" : fmt::format("{}", fmt::join(rest, ":")));
}

/// What comes of trying a device; nothing where it fails in a way that may pass, and that will show
/// again when it is opened.
std::optional<Trial> try_once(const DeviceInfo& device, const ContextOptions& options) {
    Trial trial;
    auto this_one = options;
    this_one.device = std::to_string(device.index);
    try {
        const auto text = ask_guarded("trying it", kTrialSeconds, kAnyMemory, [&] {
            try {
                return text_of(json_of(pipeline::try_device(this_one)));
            } catch (const Error&) {
                throw;
            } catch (const std::exception& error) {
                throw Error(Fault::device, error.what());
            }
        });
        trial = trial_of(nlohmann::json::parse(text));
    } catch (const Error& error) {
        if (error.fault() != Fault::input) {
            return std::nullopt;
        }
        trial.refusal = "its driver crashed or did not end when it was tried";
    }
    trial.device = device::identity(device);
    if (!trial.refusal.empty()) {
        trial.refusal += fmt::format(" (remove {} to try it again)", known_file().string());
    }
    return trial;
}

/// Tries the device that `choose` names until that is one which is known.
ContextOptions tried(
    const std::string& device, bool one_is_needed,
    const std::function<std::optional<DeviceInfo>(const ContextOptions&)>& choose) {
    ContextOptions options = {.device = device, .cache_directory = cache_directory()};
    if (device == engine::kHost) {
        return options;
    }
    Known known = read_known();
    leave_out_crashing(known, one_is_needed);
    options.trials = known.trials;
    if (memory_is_limited()) {
        try_device_where_limited([&] {
            if (const auto chosen = choose(options)) {
                const device::Context context(options);
            }
        });
        return options;
    }
    for (;;) {
        const auto chosen = choose(options);
        if (!chosen || device::trial_of(*chosen, options.trials) != nullptr) {
            return options;
        }
        const auto trial = try_once(*chosen, options);
        if (!trial) {
            return options;
        }
        options.trials.push_back(*trial);
        known.trials = options.trials;
        keep_known(known);
    }
}

}  // namespace

std::filesystem::path cache_directory() {
    const auto absolute = [](const char* name) {
        const char* const value = std::getenv(name);
        return std::filesystem::path(value != nullptr && value[0] == '/' ? value : "");
    };
    const auto cache = absolute("XDG_CACHE_HOME");
    const auto home = absolute("HOME");
    return !cache.empty()  ? cache / "merl-scan"
           : !home.empty() ? home / ".cache" / "merl-scan"
                           : std::filesystem::path();
}

ContextOptions untried_device(const std::string& device) {
    ContextOptions options = {.device = device, .cache_directory = cache_directory()};
    if (device != engine::kHost) {
        Known known = read_known();
        leave_out_crashing(known, !device.empty());
    }
    return options;
}

std::vector<Trial> known_trials() {
    return read_known().trials;
}

ContextOptions tried_device(const std::string& device,
                            std::span<const engine::Metric* const> metrics) {
    const bool is_needed = !device.empty() || std::ranges::any_of(metrics, [](const auto* metric) {
        return !metric->has_twin();
    });
    return tried(device, is_needed, [&](const ContextOptions& options) {
        return engine::Engines(options).device_for(metrics);
    });
}

ContextOptions tried_device(const std::string& device) {
    return tried(device, true, [](const ContextOptions& options) -> std::optional<DeviceInfo> {
        const auto devices = device::list_devices(options.trials);
        return devices[device::choose_device(devices, options.device)];
    });
}

}  // namespace merl::app
