#include <fmt/format.h>

#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/known_devices.h"
#include "app/cli/terminal.h"
#include "app/cli/tried_device.h"
#include "app/commands/commands.h"
#include "engine/device/context.h"
#include "engine/distance/engines.h"

namespace merl::app {
namespace {

void print_devices() {
    const auto trials = read_known_devices().trials;
    for (const auto& d : device::list_devices(trials)) {
        print_line(fmt::format("{}: {}", d.index, d.name));
        print_line(fmt::format("   {}, Vulkan {}, {}", d.kind, d.vulkan,
                               d.driver.empty() ? "unknown driver" : d.driver));
        if (d.refusal) {
            print_line(fmt::format("   cannot be used: {}", *d.refusal));
        } else {
            print_line(fmt::format(
                "   can be used: {:.1f} GiB of memory, buffers up to {:.2f} GiB, {} lanes a "
                "subgroup{}",
                static_cast<double>(d.limits.heap_bytes) / 0x1p30,
                static_cast<double>(d.limits.storage_buffer_bytes) / 0x1p30, d.limits.subgroup_size,
                d.limits.floats.float64
                    ? ""
                    : "; without float64 in shaders: not for your own metrics"));
            if (!d.is_conformant) {
                print_line(
                    "   its driver is not conformant: used for your own metrics, or if you name "
                    "it");
            }
            const auto* const trial = device::trial_of(d, trials);
            if (trial != nullptr && trial->loses_to_host) {
                print_line(
                    "   slower than the host when it was tried: used for your own metrics, or if "
                    "you name it");
            }
        }
    }
}

int list() {
    print_line(fmt::format("{}: this processor, without Vulkan", engine::kHost));
    print_line(
        "   can be used for the metrics of the library; not for spheres or your own metrics");
    try {
        untried_device("");
        print_devices();
    } catch (const device::NoDriverError& error) {
        print_line(with_advice(error));
    }
    return kSuccess;
}

}  // namespace

void add_devices(CLI::App& program, Command& chosen) {
    auto* command = program.add_subcommand(
        "devices", "What can compute: this processor, and every Vulkan device or why not");
    command->footer(
        "Examples:\n"
        "  merl-scan devices\n"
        "  merl-scan scan --device host     the processor, without Vulkan\n"
        "  merl-scan scan --device 0        a Vulkan device by its number\n"
        "  merl-scan scan --device llvm     by a part of its name; its shaders compute everything");
    command->callback([&chosen] { chosen = list; });
}

}  // namespace merl::app
