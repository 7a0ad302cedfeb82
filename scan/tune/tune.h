#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "scan/score/score.h"
#include "scan/tune/fit.h"
#include "scan/tune/folds.h"

namespace merl::scan {

/// A fit to a part of the judgements.
struct FoldFit {
    Fold fold;
    std::uint64_t trained;  ///< judgements that it was fitted on
    std::uint64_t tested;   ///< judgements that it was tested on
    Fit fit;
};

/// What fits say of judgements that they have not seen.
struct CrossValidation {
    FoldKind kind;
    std::vector<FoldFit> folds;  ///< none: there are too few materials
    /// Of the judgements that are tested, by the parameters at the start and by those that were
    /// fitted; the slopes of both are fitted on what is not tested. What is tested several times
    /// has the mean of its predictions. Only where there are folds.
    PredictionScores scores;
};

/// How fits search, and whether several may at a time.
struct TuneOptions {
    FitOptions fit;
    bool at_once = true;  ///< whether `distances_at` may be called by several threads
};

/// A metric fitted to all judgements, and to parts of them.
struct Tuning {
    std::vector<TuneParameter> parameters;
    double start_slope;       ///< of the choice model at the start
    Fit fit;                  ///< to all judgements
    PredictionScores scores;  ///< on the same judgements, at the start and fitted
    CrossValidation by_reference;
    CrossValidation by_materials;
    std::uint64_t evaluations;  ///< of distances, all fits together
    std::uint64_t fits;         ///< the one to all judgements, and those of the folds
    std::uint64_t cut_short;    ///< of them, that ended because evaluations ran out
};

/// The most evaluations of distances that tune() may need.
std::uint64_t most_evaluations(const Judgements& judgements, const FitOptions& options);

/// Fits parameters to judgements (fit_parameters), and to the parts of them that make_folds() cuts,
/// from the same starts. Nothing depends on the number of threads. `progress` is called with the
/// share that is done, one call at a time, by any thread; what it throws comes out.
Tuning tune(const Judgements& judgements, std::span<const TuneParameter> parameters,
            const DistancesAt& distances_at, const TuneOptions& options,
            const std::function<void(double share)>& progress = {});

/// Sets the slopes and scores of the start and of the fit to all judgements by these distances,
/// which may be more exact than those that the search had.
void score_tuning(Tuning& tuning, const Judgements& judgements,
                  std::span<const double> start_distances,
                  std::span<const double> fitted_distances);

/// Fewer untied judgements for each fitted parameter than this are too few: the ten events for each
/// variable that Peduzzi et al., J. Clin. Epidemiol. 49(12), 1996, ask of logistic regressions.
inline constexpr std::uint64_t fewest_judgements_per_parameter = 10;

/// Why the fitted parameters should not be believed, one sentence each; none where nothing speaks
/// against them.
std::vector<std::string> doubts(const Tuning& tuning);

}  // namespace merl::scan
