#include <gtest/gtest.h>

#include "tests/scan/score/simulated_judges.h"

namespace merl::scan::testing {
namespace {

// A short version of the table in docs/scoring.md. Intervals that have references for clusters
// cover 0.4 to 0.8 of the first two.
TEST(ScoreCoverage, IntervalsCoverWhateverMaterialsDo) {
    const SimulatedStudy study = {.materials = 40, .configurations = 1000, .references = 40};
    for (const SimulatedEffects& effects : {SimulatedEffects{"difficulty", 0, 0, 0.4},
                                            {"alternatives", 0, 0.5, 0},
                                            {"both", 0.5, 0.5, 0},
                                            {"references", 0.5, 0, 0}}) {
        const auto coverage = simulated_coverage(study, effects, 150);
        for (std::size_t f = 0; f < coverage.figures.size(); ++f) {
            EXPECT_GE(coverage.figures.at(f).coverage, 0.93)
                << effects.name << ", " << kSimulatedFigures[f];
        }
        if (effects.references == 0) {
            EXPECT_LT(coverage.by_reference, 0.9) << effects.name;
        }
    }
}

// Where nothing is shared a judgement is counted for each of its three materials: too wide by up to
// a root of three, and no more.
TEST(ScoreCoverage, IntervalsAreNotWiderThanSaid) {
    const auto coverage = simulated_coverage({40, 1000, 40}, {"none", 0, 0, 0}, 150);
    for (std::size_t f = 0; f < coverage.figures.size(); ++f) {
        EXPECT_GE(coverage.figures.at(f).coverage, 0.97) << kSimulatedFigures[f];
        EXPECT_LT(coverage.figures.at(f).too_wide, 1.9) << kSimulatedFigures[f];
    }
}

// Few references say little about others, however many alternatives each has.
TEST(ScoreCoverage, FewReferencesHaveWideIntervals) {
    const auto coverage = simulated_coverage({50, 400, 5}, {"references", 0.5, 0, 0}, 300);
    for (std::size_t f = 0; f < coverage.figures.size(); ++f) {
        EXPECT_GE(coverage.figures.at(f).coverage, 0.93) << kSimulatedFigures[f];
    }
}

}  // namespace
}  // namespace merl::scan::testing
