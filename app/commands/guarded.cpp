#include <fmt/format.h>

#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/known_devices.h"
#include "app/commands/commands.h"
#include "app/pipeline/metrics.h"
#include "app/pipeline/trial.h"
#include "engine/base/error.h"
#include "engine/device/context.h"
#include "engine/metric/metric.h"

namespace merl::app {
namespace {

/// What is known of devices helps those that are opened here, and refuses none.
device::ContextOptions options_for(const std::string& device) {
    device::ContextOptions options = {.device = device, .cache_directory = cache_directory()};
    options.trials = read_known_devices().trials;
    for (auto& trial : options.trials) {
        trial.refusal.clear();
    }
    return options;
}

/// Loads the drivers there are.
std::string load() {
    try {
        device::list_devices();
    } catch (const std::exception&) {
        // There will be the same to say when it is not only tried.
    }
    return "";
}

std::string try_device(const std::string& device) {
    try {
        return text_of_trial(
            pipeline::try_device({.device = device, .cache_directory = cache_directory()}));
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        throw Error(Fault::device, error.what());
    }
}

std::string try_metric(const std::string& device, const std::string& text) {
    with_little_stack(
        [&] { pipeline::try_metric(engine::open_metric(text), options_for(device)); });
    return "";
}

}  // namespace

void add_guarded(CLI::App& program, Command& chosen) {
    auto words = std::make_shared<std::vector<std::string>>();
    auto* command = program.add_subcommand(kGuarded, "What this program asks itself (guard.h)");
    command->group("");
    command->add_option("words", *words, "Nothing, a device, or a device and a metric");
    command->callback([&chosen, words] {
        chosen = [words] {
            answer([&] {
                switch (words->size()) {
                    case 0:
                        return load();
                    case 1:
                        return try_device(words->at(0));
                    default:
                        return try_metric(words->at(0), words->at(1));
                }
            });
            return kSuccess;
        };
    });
}

}  // namespace merl::app
