#include <fmt/format.h>

#include "app/cli/exit_status.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "engine/device/context.h"

namespace merl::app {
namespace {

int list() {
    const auto devices = device::list_devices();
    if (devices.empty()) {
        print_line(device::why_no_device());
        return kDevice;
    }
    bool usable = false;
    for (const auto& d : devices) {
        print_line(fmt::format("{}: {}", d.index, d.name));
        print_line(fmt::format("   {}, Vulkan {}, {}", d.kind, d.vulkan,
                               d.driver.empty() ? "unknown driver" : d.driver));
        if (d.refusal) {
            print_line(fmt::format("   cannot be used: {}", *d.refusal));
        } else {
            usable = true;
            print_line(fmt::format(
                "   can be used: {:.1f} GiB of memory, buffers up to {:.2f} GiB, {} lanes a "
                "subgroup",
                static_cast<double>(d.limits.heap_bytes) / 0x1p30,
                static_cast<double>(d.limits.storage_buffer_bytes) / 0x1p30,
                d.limits.subgroup_size));
        }
    }
    return usable ? kSuccess : kDevice;
}

}  // namespace

void add_devices(CLI::App& program, Command& chosen) {
    auto* command = program.add_subcommand(
        "devices", "Every Vulkan device, whether it can be used, and if not why");
    command->footer(
        "Examples:\n"
        "  merl-scan devices\n"
        "  merl-scan scan --device 0        by its number\n"
        "  merl-scan scan --device llvm     by a part of its name");
    command->callback([&chosen] { chosen = list; });
}

}  // namespace merl::app
