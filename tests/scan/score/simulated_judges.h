#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "scan/score/score.h"

namespace merl::scan::testing {

/// How many judgements of what. Alternatives are drawn from all materials.
struct SimulatedStudy {
    std::uint32_t materials;
    std::uint32_t configurations;  ///< distinct, with four votes each
    std::uint32_t references;      ///< so many of the materials, in turn; 0: four materials each
};

/// Standard deviations of what is drawn anew for every material.
struct SimulatedEffects {
    std::string name;
    double references;    ///< which metric people follow, and how surely, depends on the reference
    double alternatives;  ///< people see an alternative nearer or farther than the metrics do
    double difficulty;    ///< how sure people are depends on all materials of a configuration
};

/// The figures of two metrics, of which neither is better in expectation.
inline constexpr std::array kSimulatedFigures = {"majorities", "votes",   "slope",
                                                 "likelihood", "ceiling", "difference"};

/// What many studies with other materials, judged by others, say of the intervals.
struct SimulatedCoverage {
    struct Figure {
        double coverage;  ///< share of the intervals that have the expectation in them
        double too_wide;  ///< mean width over that of 1.96 standard deviations of the studies
    };
    std::array<Figure, kSimulatedFigures.size()> figures;
    double by_reference;  ///< coverage for the majorities with references as the only clusters
    double pairs_once;    ///< the same, counting pairs of judgements that share a material once
    double surprising;    ///< share of p-values of the difference, which is 0, below 0.001
};

/// The same for the same arguments on every machine; study i has seed i.
SimulatedCoverage simulated_coverage(const SimulatedStudy& study, const SimulatedEffects& effects,
                                     std::uint32_t studies);

}  // namespace merl::scan::testing
