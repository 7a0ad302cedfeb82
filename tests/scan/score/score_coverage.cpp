// Prints the table of docs/scoring.md: how often the intervals of `score` have the truth in them.
// score_coverage [STUDIES]: the number of simulated studies a row, by default 2,000, and half of
// them where there are 22,801 configurations.

#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>

#include "tests/scan/score/simulated_judges.h"

int main(int argc, char** argv) {
    using namespace merl::scan::testing;
    const auto studies =
        static_cast<std::uint32_t>(argc > 1 ? std::strtoul(argv[1], nullptr, 10) : 2000);
    if (studies < 16) {
        fmt::print(stderr, "score_coverage: found {} studies; expected 16 or more\n",
                   argc > 1 ? argv[1] : "no");
        return 2;
    }
    fmt::print("| materials | configurations | effects |");
    for (const auto* figure : kSimulatedFigures) {
        fmt::print(" {} |", figure);
    }
    fmt::print(
        " by reference | pairs once | p < 0.001 "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
    for (const SimulatedStudy& study : {SimulatedStudy{100, 22'801, 100},
                                        {40, 1000, 40},
                                        {20, 200, 20},
                                        {10, 60, 10},
                                        {50, 400, 5},
                                        {20, 200, 0}}) {
        for (const SimulatedEffects& effects : {SimulatedEffects{"none", 0, 0, 0},
                                                {"references", 0.5, 0, 0},
                                                {"alternatives", 0, 0.5, 0},
                                                {"both", 0.5, 0.5, 0},
                                                {"difficulty", 0, 0, 0.4}}) {
            const bool large = study.configurations > 10'000;
            const auto coverage = simulated_coverage(study, effects, large ? studies / 2 : studies);
            fmt::print("| {} | {} | {} |",
                       study.references == 0 ? fmt::format("{}, no reference", study.materials)
                       : study.references < study.materials
                           ? fmt::format("{}, {} references", study.materials, study.references)
                           : fmt::format("{}", study.materials),
                       study.configurations, effects.name);
            for (const auto& figure : coverage.figures) {
                fmt::print(" {:.3f} ×{:.2f} |", figure.coverage, figure.too_wide);
            }
            fmt::print(" {} | {:.3f} | {:.4f} |\n",
                       study.references == 0 ? "–" : fmt::format("{:.3f}", coverage.by_reference),
                       coverage.pairs_once, coverage.surprising);
            std::fflush(stdout);
        }
    }
    return 0;
}
