#include "app/pipeline/verify.h"

#include <fmt/format.h>

#include <memory>
#include <string>
#include <string_view>

#include "app/cli/control.h"
#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/cli/tried_device.h"
#include "app/commands/commands.h"
#include "app/output/provenance.h"

namespace merl::app {
namespace {

struct Options {
    std::string device;
    bool quiet = false;
};

void print_row(std::string_view check, std::string_view expected, std::string_view actual,
               std::string_view error, std::string_view allowed, std::string_view result) {
    print_line(fmt::format("{:<44} {:>14} {:>14} {:>9} {:>9}  {}", check, expected, actual, error,
                           allowed, result));
}

int run(const Options& options) {
    const auto device = untried_device(options.device);
    TerminalControl control(options.quiet);
    const pipeline::VerifySink sink = {
        .engine =
            [](const engine::EngineDescription& engine) {
                print_line(engine_text(engine));
                print_line("");
                print_row("check", "expected", "actual", "error", "allowed", "result");
            },
        .check =
            [&](const pipeline::Check& c) {
                control.clear();
                print_row(c.name, c.expected, c.actual, fmt::format("{:.1e}", c.error),
                          fmt::format("{:.1e}", c.allowed), c.passed() ? "PASS" : "FAIL");
            }};
    const int failures = pipeline::verify(device, sink, control.control());
    print_line("");
    print_line(failures == 0 ? "PASS: this machine computes what it should"
                             : fmt::format("FAIL: {} checks; do not trust its results", failures));
    return failures == 0 ? kSuccess : kVerificationFailed;
}

}  // namespace

void add_verify(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command = program.add_subcommand(
        "verify", "Check this machine: the framework test, and the built-in database in float64");
    command->add_option("--device", options->device,
                        "host, or a Vulkan device by number or part of its name (default: the host "
                        "and the best device)");
    add_quiet_option(*command, options->quiet, "No progress");
    command->footer(
        "Prints expected and actual values, the relative error (for the disagreements: the\n"
        "difference) and what is allowed. The exit status is 1 if any check fails.\n"
        "\n"
        "Examples:\n"
        "  merl-scan verify\n"
        "  merl-scan verify --device llvmpipe");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
