#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "engine/device/devices.h"

namespace merl::app {

/// $XDG_CACHE_HOME/merl-scan or ~/.cache/merl-scan; empty where there is no such place.
std::filesystem::path cache_directory();

/// What came of trying drivers and devices, as the user's cache directory keeps it.
struct KnownDevices {
    /// By a fingerprint of what decides which drivers are loaded: nothing where all can be, else
    /// the manifests of those that crash. The list may be empty: then one that no list names
    /// crashes.
    std::map<std::string, std::optional<std::vector<std::string>>> drivers = {};
    std::vector<device::Trial> trials = {};
};

/// Where it is kept; empty where nothing can be.
std::filesystem::path known_devices_file();

/// What is known; nothing where that was kept by another program, or by something else.
KnownDevices read_known_devices();

void keep_known_devices(const KnownDevices& known);

// One trial, as the file has it. Reading throws nlohmann::json::exception or std::out_of_range for
// what this did not write.
std::string text_of_trial(const device::Trial& trial);
device::Trial trial_of_text(const std::string& text);

}  // namespace merl::app
