#include <fmt/format.h>

#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "engine/device/context.h"
#include "engine/distance/engines.h"

namespace merl::app {
namespace {

void print_devices() {
    for (const auto& d : device::list_devices()) {
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
        }
    }
}

int list() {
    print_line(fmt::format("{}: this processor, without Vulkan", engine::kHost));
    print_line(
        "   can be used for the metrics of the library; not for spheres or your own metrics");
    try {
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
