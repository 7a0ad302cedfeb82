#include "app/cli/options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <limits>
#include <optional>
#include <string>
#include <string_view>

#include "engine/base/number.h"

namespace merl::app {
namespace {

constexpr std::uint64_t kLargest = std::numeric_limits<std::uint64_t>::max();

std::optional<std::uint64_t> parse_bytes(const std::string& text) {
    const std::size_t digits = std::min(text.find_first_not_of("0123456789"), text.size());
    std::string unit = text.substr(digits);
    std::transform(unit.begin(), unit.end(), unit.begin(),
                   [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
    constexpr std::string_view kUnits = "bkmgtpe";
    const std::size_t power = unit.empty() ? 0 : kUnits.find(unit[0]);
    const std::string_view rest = std::string_view(unit).substr(unit.empty() ? 0 : 1);
    const bool known = power == 0
                           ? rest.empty()
                           : power < kUnits.size() && (rest.empty() || rest == "b" || rest == "ib");
    const auto number = parse_number<std::uint64_t>(std::string_view(text).substr(0, digits));
    if (!known || !number || *number > kLargest >> (10 * power)) {
        return std::nullopt;
    }
    return *number << (10 * power);
}

}  // namespace

CLI::Validator whole_number(std::uint64_t least, std::uint64_t most) {
    return {[=](std::string& text) {
                const auto value = parse_number<std::uint64_t>(text);
                if (!value || *value < least || *value > most) {
                    return fmt::format("expected a whole number from {} to {}, found \"{}\"", least,
                                       most, text);
                }
                text = std::to_string(*value);  // CLI11 would take 010 for 8
                return std::string();
            },
            ""};
}

CLI::Validator number(double least, double most) {
    return {[=](const std::string& text) {
                const auto value = parse_number<double>(text);
                // Not a number is not between them either.
                const bool good = value && *value >= least && *value <= most;
                return good ? std::string()
                            : fmt::format("expected a number from {} to {}, found \"{}\"", least,
                                          most, text);
            },
            ""};
}

CLI::Validator byte_count() {
    return {[](std::string& text) {
                const auto value = parse_bytes(text);
                if (!value) {
                    return fmt::format(
                        "expected a number of bytes below 16E, like 512M or 2G, found \"{}\"",
                        text);
                }
                text = std::to_string(*value);
                return std::string();
            },
            ""};
}

CLI::Validator not_empty() {
    return {[](const std::string& text) {
                return std::string(text.empty() ? "expected a path, found an empty text" : "");
            },
            ""};
}

CLI::Option* add_output_options(CLI::App& command, std::string& out, bool& force) {
    auto* option = command.add_option("--out", out, "The directory to make")
                       ->transform(not_empty())
                       ->capture_default_str();
    add_force_option(command, force);
    return option;
}

CLI::Option* add_selection_option(CLI::App& command, std::string& selection,
                                  const std::string& what) {
    return command.add_option("--selection", selection, "The selection.csv " + what)
        ->transform(not_empty());
}

void add_force_option(CLI::App& command, bool& force, const char* what) {
    command.add_flag("--force", force, what);
}

void add_quiet_option(CLI::App& command, bool& quiet, const char* what) {
    command.add_flag("--quiet", quiet, what);
}

void add_bootstrap_options(CLI::App& command, scan::BootstrapOptions& options) {
    command
        .add_option("--replicates", options.replicates,
                    "Bootstrap samples for the intervals that need them; 0 for none")
        ->transform(whole_number(0, 1'000'000))
        ->capture_default_str();
    command.add_option("--seed", options.seed, "Which samples those are")
        ->transform(whole_number(0, kLargest))
        ->capture_default_str();
}

}  // namespace merl::app
