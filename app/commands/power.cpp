#include "scan/statistics/power.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/cli/exit_status.h"
#include "app/cli/options.h"
#include "app/cli/progress.h"
#include "app/cli/terminal.h"
#include "app/commands/commands.h"
#include "engine/base/error.h"
#include "engine/base/number.h"
#include "scan/statistics/uniform_test.h"
#include "scan/votes/vote_statistics.h"

namespace merl::app {
namespace {

constexpr std::uint32_t kMostConfigurations = 1000;
constexpr std::uint32_t kMostJudges = 200;
constexpr std::uint32_t kColumns = 10;
constexpr double kEnough = 0.8;  // the usual power of a planned experiment

struct Options {
    std::string judges = "5:30";
    std::string configurations = "20:200";
    double p = 0.8;
    std::optional<double> equal;  // half of what p leaves without
};

struct Range {
    std::uint32_t from;
    std::uint32_t to;
};

Range range_of(const std::string& option, const std::string& text, std::uint32_t most) {
    const auto number = [&](std::string_view part) {
        const auto value = parse_number<std::uint32_t>(part);
        if (!value || *value < 1 || *value > most) {
            throw Error(Fault::usage,
                        fmt::format("{}: expected a whole number or two, FROM:TO, from 1 to {}, "
                                    "found \"{}\"",
                                    option, most, text));
        }
        return *value;
    };
    const auto colon = text.find(':');
    const std::string_view all = text;
    const std::uint32_t from = number(all.substr(0, colon));
    const std::uint32_t to = colon == std::string::npos ? from : number(all.substr(colon + 1));
    if (from > to) {
        throw Error(Fault::usage, fmt::format("{}: expected FROM:TO with FROM first, found \"{}\"",
                                              option, text));
    }
    return {from, to};
}

/// Up to kColumns numbers of the range, both ends among them, evenly spaced.
std::vector<std::uint32_t> columns_of(const Range& range) {
    const std::uint32_t span = range.to - range.from;
    const std::uint32_t steps = std::min(span, kColumns - 1);
    std::vector<std::uint32_t> columns = {range.from};
    for (std::uint32_t i = 1; i <= steps; ++i) {
        columns.push_back(range.from + span * i / steps);
    }
    return columns;
}

int run(const Options& options) {
    const Range judges = range_of("--judges", options.judges, kMostJudges);
    const auto columns =
        columns_of(range_of("--configurations", options.configurations, kMostConfigurations));
    const double equal = options.equal.value_or((1 - options.p) / 2);
    if (options.p + equal > 1 + 1e-12) {
        throw Error(Fault::usage,
                    fmt::format("--p and --equal: expected a sum of 1 or less, found {}",
                                options.p + equal));
    }
    const std::size_t rows = judges.to - judges.from + 1;
    std::vector<scan::Power> powers(rows * columns.size());
    {
        Progress progress("computing", false);
        for (std::size_t row = 0; row < rows; ++row) {
            tbb::parallel_for(std::size_t{0}, columns.size(), [&](std::size_t column) {
                powers[row * columns.size() + column] =
                    scan::power_of({.judges = judges.from + static_cast<std::uint32_t>(row),
                                    .configurations = columns[column],
                                    .right = options.p,
                                    .equal = equal},
                                   scan::significance_level);
            });
            progress.update(static_cast<double>(row + 1) / static_cast<double>(rows));
        }
    }

    print_line(fmt::format(
        "Each vote is right with probability {:g}, equal with {:g}, wrong with {:g}; "
        "level {}.",
        options.p, equal, std::abs(1 - options.p - equal) < 1e-12 ? 0 : 1 - options.p - equal,
        scan::significance_level));
    print_line(
        "Expected share of configurations that are significant: one by one, and with Holm's "
        "correction for all.");
    print_line("");
    std::string header = "judges  alone ";
    for (const auto column : columns) {
        header += fmt::format("{:>7}", column);
    }
    print_line(header + "  configurations");
    for (std::size_t row = 0; row < rows; ++row) {
        std::string line =
            fmt::format("{:>6}  {:.3f} ", judges.from + row, powers[row * columns.size()].alone);
        for (std::size_t column = 0; column < columns.size(); ++column) {
            line += fmt::format("{:>7.3f}", powers[row * columns.size() + column].holm_share);
        }
        print_line(line);
    }
    print_line("");
    for (std::size_t column = 0; column < columns.size(); ++column) {
        std::string enough = fmt::format("more than {}", judges.to);
        for (std::size_t row = 0; row < rows; ++row) {
            if (powers[row * columns.size() + column].holm_share >= kEnough) {
                enough = row == 0 ? fmt::format("{} or fewer", judges.from)
                                  : std::to_string(judges.from + row);
                break;
            }
        }
        const auto fewest = scan::fewest_judges(scan::significance_level, columns[column], 0);
        print_line(fmt::format(
            "{:>4} configurations: {} judges for {:.0f} % of them with Holm's "
            "correction; none can be significant with fewer than {}",
            columns[column], enough, 100 * kEnough, fewest ? std::to_string(*fewest) : "-"));
    }
    return kSuccess;
}

}  // namespace

void add_power(CLI::App& program, Command& chosen) {
    auto options = std::make_shared<Options>();
    auto* command =
        program.add_subcommand("power", "How many judges does a planned experiment need?");
    command->add_option("--judges", options->judges, "Numbers of judges, FROM:TO")
        ->capture_default_str();
    command
        ->add_option("--configurations", options->configurations,
                     "Numbers of configurations, FROM:TO")
        ->capture_default_str();
    command->add_option("--p", options->p, "How likely a vote is right")
        ->transform(number(0, 1))
        ->capture_default_str();
    command
        ->add_option("--equal", options->equal,
                     "How likely a vote is \"equal\"; default: half of what --p leaves")
        ->transform(number(0, 1));
    command->footer(
        "The figures are exact for independent votes (docs/experiment.md).\n"
        "\n"
        "Examples:\n"
        "  merl-scan power --judges 5:30 --configurations 20:200 --p 0.8\n"
        "  merl-scan power --judges 5:12 --configurations 100 --p 0.95 --equal 0.04");
    command->callback([&chosen, options] { chosen = [options] { return run(*options); }; });
}

}  // namespace merl::app
