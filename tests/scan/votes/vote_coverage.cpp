// How often the intervals of `votes` hold the truth, and how wide they are: the tables of
// docs/experiment.md. vote_coverage [EXPERIMENTS [CONFIGURATIONS MATERIALS [originals]]], the last
// for votes on approximations of so many originals

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "engine/base/number.h"
#include "scan/votes/vote_statistics.h"
#include "simulated_votes.h"

namespace {

using merl::scan::Estimate;
using merl::scan::SimulatedJudges;

constexpr std::array<std::uint32_t, 6> numbers_of_judges = {3, 4, 5, 8, 12, 20};

/// Simulated estimates of a figure whose true value is known.
class Coverage {
  public:
    explicit Coverage(double truth) : truth_(truth) {}

    void add(const Estimate& estimate) {
        if (!estimate.too_few.empty()) {
            return;
        }
        const auto [low, high] = estimate.interval;
        ++intervals_;
        held_ += low <= truth_ && truth_ <= high ? 1 : 0;
        width_ += high - low;
        square_ += (estimate.value - truth_) * (estimate.value - truth_);
    }

    double covered() const { return held_ / intervals_; }

    /// Of the mean width, to that of an interval that knew the standard error.
    double width() const {
        return width_ / intervals_ / (2 * 1.96 * std::sqrt(square_ / intervals_));
    }

    /// "0.951 (1.08)"
    std::string text() const {
        return intervals_ == 0 ? "none" : fmt::format("{:.3f} ({:.2f})", covered(), width());
    }

  private:
    double truth_;
    double intervals_ = 0;
    double held_ = 0;
    double width_ = 0;
    double square_ = 0;
};

/// A row of the table; returns the least coverage of any share in it.
double print_row(const char* name, SimulatedJudges simulation, std::uint32_t experiments) {
    std::string row = fmt::format("| {} | {:.2f} |", name, simulation.lead());
    double least = 1;
    for (const auto judges : numbers_of_judges) {
        simulation.judges = judges;
        Coverage lead(simulation.lead());
        std::vector<Coverage> shares;
        for (const double share : simulation.shares()) {
            shares.emplace_back(share);
        }
        for (std::uint32_t seed = 1; seed <= experiments; ++seed) {
            const auto votes = simulation.run(seed);
            // Without the bootstrap, which is of another figure.
            const auto s = merl::scan::vote_statistics(votes, {.replicates = 0}).selection;
            lead.add(s.lead);
            for (std::size_t option = 0; option < shares.size(); ++option) {
                shares[option].add(s.shares.at(option));
            }
        }
        for (const auto& share : shares) {
            least = std::min(least, share.covered());
        }
        row += fmt::format(" {} |", lead.text());
    }
    fmt::print("{}\n", row);
    (void)std::fflush(stdout);
    return least;
}

std::uint32_t argument(std::span<char*> arguments, std::size_t index, std::uint32_t otherwise) {
    if (index >= arguments.size()) {
        return otherwise;
    }
    const auto number = merl::parse_number<std::uint32_t>(arguments[index]);
    if (!number || *number < 5) {
        fmt::print(stderr, "found {}; expected a whole number, 5 or more\n", arguments[index]);
        std::exit(2);
    }
    return *number;
}

int run(std::span<char*> arguments) {
    const auto experiments = argument(arguments, 1, 1000);
    SimulatedJudges simulation;
    simulation.configurations = argument(arguments, 2, simulation.configurations);
    simulation.materials = argument(arguments, 3, simulation.materials);
    simulation.reference = arguments.size() > 4 && std::string_view(arguments[4]) == "originals";
    fmt::print(
        "{} experiments each, {} configurations of {} {}: the lead's coverage "
        "(width)\n\n| effects of | lead |",
        experiments, simulation.configurations, simulation.materials,
        simulation.reference ? "originals" : "materials");
    for (const auto judges : numbers_of_judges) {
        fmt::print(" {} judges |", judges);
    }
    fmt::print("\n|---|---|---|---|---|---|---|---|\n");
    struct Effects {
        const char* name;
        double judge;
        double material;
        double configuration;
    };
    double least = 1;
    for (const double mean : {0.0, 0.5, 2.0}) {
        for (const auto& [name, judge, material, configuration] :
             {Effects{"nothing", 0, 0, 0},
              {"judges, ½", 0.5, 0, 0},
              {"judges, 1", 1, 0, 0},
              {"judges, 2", 2, 0, 0},
              {"materials, 0.7", 0, 0.7, 0},
              {"materials, 2", 0, 2, 0},
              {"configurations, 1", 0, 0, 1},
              {"judges ½, materials 0.7", 0.5, 0.7, 0},
              {"all three, 1 each", 1, 1, 1}}) {
            simulation.mean = mean;
            simulation.judge_effect = judge;
            simulation.material_effect = material;
            simulation.configuration_effect = configuration;
            least = std::min(least, print_row(name, simulation, experiments));
        }
    }
    fmt::print("\nThe least coverage of a share: {:.3f}\n", least);
    return 0;
}

}  // namespace

int main(int count, char** arguments) {
    try {
        return run({arguments, static_cast<std::size_t>(count)});
    } catch (const std::exception& error) {
        (void)std::fprintf(stderr, "%s\n", error.what());
        return 1;
    }
}
