#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <new>
#include <stdexcept>

#include "app/commands.h"
#include "app/exit_status.h"
#include "app/interrupt.h"
#include "app/terminal.h"
#include "app/version.h"
#include "engine/error.h"
#include "scan/input.h"

namespace {

using namespace merl::app;

int status_of(merl::Fault fault) {
    switch (fault) {
        case merl::Fault::usage:
            return kUsage;
        case merl::Fault::input:
            return kInput;
        case merl::Fault::device:
            return kDevice;
        case merl::Fault::output:
            return kOutput;
    }
    return kInternal;
}

int complain(const char* kind, const char* message, int status) noexcept {
    std::fprintf(stderr, "merl-scan: %s%s\n", kind, printable(message).c_str());
    return status;
}

/// Opens what the caller has closed of standard input, output and error: a file would get its
/// number, and what is printed would end up there.
void open_standard_files() {
    int descriptor = 0;
    do {
        descriptor = ::open("/dev/null", O_RDWR);
    } while (descriptor >= 0 && descriptor <= STDERR_FILENO);
    ::close(descriptor);
}

/// One line on what is wrong with the command line.
std::string usage_text(const CLI::App& program, const CLI::ParseError& error) {
    // CLI11 misses the command before it looks at the word that stands in its place.
    const auto unknown = program.remaining(true);
    const bool required = dynamic_cast<const CLI::RequiredError*>(&error) != nullptr;
    return required && !unknown.empty()
               ? fmt::format("\"{}\" is no command or option; see --help", unknown.front())
               : fmt::format("{}; see --help", error.what());
}

/// Reads the command line and runs the chosen command.
int run(int argc, char** argv) {
    CLI::App program("The bench for reflectance metrics: where do two of them disagree?",
                     "merl-scan");
    program.set_version_flag("--version", kVersion);
    program.require_subcommand(1);
    program.footer(
        "Examples:\n"
        "  merl-scan scan                                   the built-in database, into "
        "./merl-scan-results\n"
        "  merl-scan scan --database ~/merl/brdfs --out results\n"
        "  merl-scan verify                                 is this device exact?\n"
        "  merl-scan scan --help                            all options of a command\n"
        "\n"
        "Exit status: 0 success, 1 verification failed, 2 usage, 3 bad input, 4 no usable device,\n"
        "5 output cannot be written, 70 internal error, 128 + signal when interrupted.");
    Command chosen;
    add_scan(program, chosen);
    add_compare(program, chosen);
    add_score(program, chosen);
    add_votes(program, chosen);
    add_power(program, chosen);
    add_metrics(program, chosen);
    add_devices(program, chosen);
    add_database(program, chosen);
    add_verify(program, chosen);
    add_slices(program, chosen);
    add_render(program, chosen);
    add_judge(program, chosen);
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() != 0) {
            return complain("", usage_text(program, error).c_str(), kUsage);
        }
        program.exit(error);  // prints the help or the version
        flush_output();
        return kSuccess;
    }
    catch_interrupts();
    const int status = chosen();
    flush_output();
    return status;
}

}  // namespace

/// Whatever goes wrong becomes one line and an exit status.
int main(int argc, char** argv) {
    try {
        open_standard_files();
        return run(argc, argv);
    } catch (const merl::Error& error) {
        return complain("", error.what(), status_of(error.fault()));
    } catch (const merl::scan::InputError& error) {
        return complain("", error.what(), kInput);
    } catch (const Interrupted& interrupt) {
        say_interrupted();
        return kInterrupted + interrupt.signal();
    } catch (const std::bad_alloc&) {
        return complain("", "out of memory", kInternal);
    } catch (const std::exception& error) {
        if (std::ferror(stdout) != 0) {  // fmt::print throws
            return complain("", "standard output cannot be written", kOutput);
        }
        return complain("internal error: ", error.what(), kInternal);
    }
}
