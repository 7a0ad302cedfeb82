#include <fmt/format.h>

#include <exception>
#include <string>

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

std::string try_metric(const std::string& text, const std::string& device) {
    with_little_stack(
        [&] { pipeline::try_metric(engine::open_metric(text), options_for(device)); });
    return "";
}

}  // namespace

void add_guarded(CLI::App& program, Command& chosen) {
    struct Options {
        std::string device;
        std::string metric;
    };
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(kGuarded, "What this program asks itself (guard.h)");
    command->group("");
    command->add_option("device", options->device)->required();
    command->add_option("metric", options->metric);
    command->callback([&chosen, options] {
        chosen = [options] {
            answer([&] {
                return options->metric.empty() ? try_device(options->device)
                                               : try_metric(options->metric, options->device);
            });
            return kSuccess;
        };
    });
}

}  // namespace merl::app
