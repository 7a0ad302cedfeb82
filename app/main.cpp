#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>

#include "app/cli/declared.h"
#include "app/cli/exit_status.h"
#include "app/cli/guard.h"
#include "app/cli/interrupt.h"
#include "app/cli/ranks.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/output/output_directory.h"
#include "app/pipeline/version.h"
#include "engine/base/error.h"
#include "engine/base/text.h"
#include "engine/database/bad_files.h"
#include "engine/device/context.h"

namespace {

using namespace merl::app;
namespace pipeline = merl::pipeline;

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
        case merl::Fault::resource:
            return kResource;
    }
    return kInternal;
}

/// One line, however long a text is that somebody's file holds: of more than `most` bytes the
/// beginning and the end.
int complain(const char* kind, std::string_view message, int status,
             std::size_t most = 3000) noexcept {
    constexpr std::size_t kPart = 1000;  // bytes of the beginning and of the end
    const bool is_long = message.size() > most;
    std::fprintf(stderr, "merl-scan: %s%s%s%s%s\n", kind,
                 merl::printable(is_long ? message.substr(0, kPart) : message).c_str(),
                 is_long ? " ... " : "",
                 is_long ? merl::printable(message.substr(message.size() - kPart)).c_str() : "",
                 results_are_in_place() ? "; the results are complete and in place" : "");
    return status;
}

/// Whether the system has no more to give, which is no fault of the program.
bool is_shortage(const std::error_code& code) {
    return code == std::errc::resource_unavailable_try_again ||
           code == std::errc::not_enough_memory || code == std::errc::too_many_files_open ||
           code == std::errc::too_many_files_open_in_system;
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
    program.formatter(std::make_shared<HelpFormatter>());
    program.set_version_flag("-V,--version", pipeline::kVersion);
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
        "5 output cannot be written, 6 not enough memory, threads or open files, 70 internal "
        "error,\n"
        "128 + signal when interrupted.");
    Command chosen;
    add_scan(program, chosen);
    add_distances(program, chosen);
    add_compare(program, chosen);
    add_score(program, chosen);
    add_tune(program, chosen);
    add_votes(program, chosen);
    add_power(program, chosen);
    add_metrics(program, chosen);
    add_models(program, chosen);
    add_devices(program, chosen);
    add_database(program, chosen);
    add_verify(program, chosen);
    add_slices(program, chosen);
    add_render(program, chosen);
    add_judge(program, chosen);
    add_cite(program, chosen);
    add_help(program, chosen);
    add_man(program, chosen);
    add_completion(program, chosen);
    add_guarded(program, chosen);
    catch_interrupts();
    try {
        program.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() != 0) {
            return complain("", usage_text(program, error), kUsage);
        }
        program.exit(error);  // prints the help or the version
        flush_output();
        return kSuccess;
    }
    merl::device::widen_lavapipe();
    const int status = chosen();
    flush_output();
    return status;
}

/// Whatever goes wrong becomes one line and an exit status.
int status_of_run(int argc, char** argv) {
    try {
        open_standard_files();
        return run(argc, argv);
    } catch (const merl::device::NoDriverError& error) {
        return complain("", with_advice(error), kDevice);
    } catch (const merl::device::DeviceLostError& error) {
        return complain("", with_advice(error), kDevice);
    } catch (const merl::engine::BadFilesError& error) {
        return complain("", std::string(error.what()) + "; --skip-bad leaves them out", kInput,
                        /*most=*/64 << 10U);
    } catch (const merl::Error& error) {
        return complain("", error.what(), status_of(error.fault()));
    } catch (const Interrupted& interrupt) {
        if (results_are_in_place()) {
            return complain("", "interrupted", kInterrupted + interrupt.signal());
        }
        say_interrupted();
        return kInterrupted + interrupt.signal();
    } catch (const std::bad_alloc&) {
        return complain("",
                        "out of memory; work on less at a time (--memory, --threads, "
                        "--disagreements, --replicates) or raise the limit (ulimit -v, the "
                        "container's)",
                        kResource);
    } catch (const std::system_error& error) {
        if (is_shortage(error.code())) {
            return complain("not enough threads, memory or open files: ", error.what(), kResource);
        }
        return complain("internal error: ", error.what(), kInternal);
    } catch (const std::exception& error) {
        // oneTBB has no other name for it.
        if (std::string_view(error.what()).find("pthread_create has failed") !=
            std::string_view::npos) {
            return complain("",
                            "no more threads can be started; ask for fewer (--threads) or raise "
                            "the limit (ulimit -u, the container's; ulimit -v)",
                            kResource);
        }
        return complain("internal error: ", error.what(), kInternal);
    }
}

}  // namespace

int main(int argc, char** argv) {
    const int status = status_of_run(argc, argv);
    end_ranks(status);
    return status;
}
