#pragma once

#include <CLI/CLI.hpp>
#include <optional>
#include <string>

#include "app/commands/obtain_distances.h"

namespace merl::app {

/// The options of `score` for ratings of approximations.
struct RatingOptions {
    std::string ratings;
    std::string names;      // a file; empty: names are as they are
    std::string reference;  // the label of originals, or empty
    std::string scale;      // LOW:HIGH, or empty
    std::optional<double> differ_by;
};

/// The options of `score`, with --judgements or with --ratings.
struct ScoreOptions {
    DistanceOptions distances;
    std::string judgements;
    RatingOptions ratings;
    std::string out = "merl-scan-score";
    bool force = false;
    bool quiet = false;
};

/// The metrics that `score` works with.
inline const MetricNeeds kScoreMetrics = {.from_database = "all"};

/// Adds --ratings and what goes with it. Returns --ratings.
CLI::Option* add_rating_options(CLI::App& command, RatingOptions& options);

/// Scores ratings of approximations. Returns the exit status.
int score_ratings(const ScoreOptions& options);

}  // namespace merl::app
