#include <fmt/format.h>

#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "app/pipeline/version.h"
#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/io/json_format.h"

namespace merl::app {
namespace {

constexpr const char* kQuote = "quote";

/// The line that the summary of results has. Throws InputError where there is none.
std::string recorded_quote(const std::string& results) {
    std::error_code ignored;
    const auto file = std::filesystem::is_directory(results, ignored)
                          ? (std::filesystem::path(results) / "summary.json").string()
                          : results;
    const auto json = nlohmann::json::parse(scan::read_input(file), nullptr, false);
    if (!json.is_object() || !json.contains("program")) {
        throw InputError(
            fmt::format("{}: is no summary of merl-scan; expected a directory of results, or their "
                        "summary.json",
                        file));
    }
    scan::expect_known_format(json, file);
    const auto quote = json.find(kQuote);
    if (quote == json.end() || !quote->is_string()) {
        throw InputError(
            fmt::format("{}: has no \"{}\": it is of a command that computes no distances, or of "
                        "an older merl-scan; run the command again",
                        file, kQuote));
    }
    return quote->get<std::string>();
}

void cite_program() {
    print_lines(
        fmt::format("merl-scan v{0}, the bench for reflectance metrics\n"
                    "\n"
                    "@software{{merl_scan,\n"
                    "  title = {{merl-scan, the bench for reflectance metrics}},\n"
                    "  author = {{{{The merl-scan developers}}}},\n"
                    "  version = {{{0}}}\n"
                    "}}\n",
                    pipeline::kVersion));
}

}  // namespace

void add_cite(CLI::App& program, Command& chosen) {
    auto* command =
        program.add_subcommand("cite", "What to say in a paper of the program, or of results");
    auto results = std::make_shared<std::string>();
    command
        ->add_option("results", *results,
                     "A directory of results, or its summary.json; none: the program")
        ->transform(not_empty());
    command->footer(
        "Of results it prints the line that says what computed them: program and version, metrics\n"
        "with parameters, database with hash and grid, engine, and whether numbers are float64 or\n"
        "have a bound. `merl-scan metrics` and `models` say whose metrics and fits they are.\n"
        "\n"
        "Examples:\n"
        "  merl-scan cite\n"
        "  merl-scan cite merl-scan-results");
    command->callback([&chosen, results] {
        chosen = [results] {
            if (results->empty()) {
                cite_program();
            } else {
                print_line(recorded_quote(*results));
            }
            return kSuccess;
        };
    });
}

}  // namespace merl::app
