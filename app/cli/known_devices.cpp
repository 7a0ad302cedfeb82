#include "app/cli/known_devices.h"

#include <fmt/format.h>

#include <cstdint>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "app/pipeline/version.h"
#include "engine/base/hash.h"
#include "engine/base/kept_file.h"
#include "engine/metric/metric_library.h"

namespace merl::app {
namespace {

using device::Trial;
using nlohmann::json;

/// A driver may call its device anything.
std::string text_of(const json& value) {
    return value.dump(1, ' ', false, json::error_handler_t::replace);
}

/// What is true of one program need not be of the next, which may have other shaders or look for
/// other things.
std::string program() {
    std::string shaders;
    for (const auto& file : engine::shader_files()) {
        shaders += file.text;
    }
    constexpr int kFormat = 1;
    return fmt::format("{} {} {}", kFormat, pipeline::kVersion, hash_of(shaders));
}

json json_of(const Trial& trial) {
    json value = {{"device", trial.device},
                  {"refusal", trial.refusal},
                  {"loses_to_host", trial.loses_to_host}};
    if (trial.tiles) {
        value["tiles"] = {{"power", trial.tiles->power}, {"square", trial.tiles->square}};
    }
    return value;
}

std::uint32_t side_of(const json& value) {
    constexpr std::uint64_t kMost = 10;
    if (!value.is_number_unsigned() || value < 1 || value > kMost) {
        throw std::out_of_range("no side of a tile");
    }
    return value.get<std::uint32_t>();
}

Trial trial_of(const json& value) {
    Trial trial = {.device = value.at("device").get<std::string>(),
                   .refusal = value.at("refusal").get<std::string>(),
                   .loses_to_host = value.at("loses_to_host").get<bool>()};
    if (value.contains("tiles")) {
        const auto& tiles = value.at("tiles");
        trial.tiles = {.power = side_of(tiles.at("power")), .square = side_of(tiles.at("square"))};
    }
    return trial;
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

std::filesystem::path known_devices_file() {
    const auto directory = cache_directory();
    return directory.empty() ? directory : directory / "devices.json";
}

KnownDevices read_known_devices() {
    constexpr std::uint64_t kMost = std::uint64_t{1} << 20U;
    const auto file = known_devices_file();
    const auto text = file.empty() ? std::nullopt : read_kept(file, kMost);
    try {
        KnownDevices known;
        const auto all = json::parse(text.value_or("{}"));
        if (all.value("program", "") != program()) {
            return {};
        }
        for (const auto& [fingerprint, crashing] : all.at("drivers").items()) {
            known.drivers[fingerprint] =
                crashing.is_null() ? std::nullopt
                                   : std::optional(crashing.get<std::vector<std::string>>());
        }
        for (const auto& trial : all.at("trials")) {
            known.trials.push_back(trial_of(trial));
        }
        return known;
    } catch (const json::exception&) {
        return {};
    } catch (const std::out_of_range&) {
        return {};
    }
}

void keep_known_devices(const KnownDevices& known) {
    const auto file = known_devices_file();
    if (file.empty()) {
        return;
    }
    auto drivers = json::object();
    for (const auto& [fingerprint, crashing] : known.drivers) {
        drivers[fingerprint] = crashing ? json(*crashing) : json();
    }
    auto trials = json::array();
    for (const auto& trial : known.trials) {
        trials.push_back(json_of(trial));
    }
    keep(file, text_of({{"program", program()}, {"drivers", drivers}, {"trials", trials}}));
}

std::string text_of_trial(const Trial& trial) {
    return text_of(json_of(trial));
}

Trial trial_of_text(const std::string& text) {
    return trial_of(json::parse(text));
}

}  // namespace merl::app
