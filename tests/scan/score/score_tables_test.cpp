#include "scan/score/score_tables.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <limits>
#include <string>

namespace merl::scan {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

std::string written(void (*write)(int, const Score&), const Score& score) {
    std::FILE* const file = std::tmpfile();
    write(::fileno(file), score);
    std::rewind(file);
    std::array<char, 4096> text{};
    const std::size_t size = std::fread(text.data(), 1, text.size(), file);
    std::fclose(file);
    return {text.data(), size};
}

Score two_metrics() {
    Score score{};
    score.metrics = {{.name = "a,b",
                      .majorities = {0.75, {0.5, 1}},
                      .votes = {0.625, {0.25, 0.75}},
                      .slope = {std::numeric_limits<double>::infinity(), {1.5, 2}},
                      .log_likelihood = {-0.5, {-1, -0.25}},
                      .total_log_likelihood = -100,
                      .ties = 1,
                      .undecided = 2,
                      .zero_distances = 3,
                      .selected = true},
                     {.name = "=c",
                      .majorities = {kNone, {kNone, kNone}},
                      .votes = {0.5, {kNone, kNone}},
                      .slope = {0, {kNone, kNone}},
                      .log_likelihood = {-0.7, {kNone, kNone}},
                      .total_log_likelihood = -7,
                      .ties = 0,
                      .undecided = 0,
                      .zero_distances = 0,
                      .fitted = true}};
    score.pairs = {{.first = 0,
                    .second = 1,
                    .first_right = 29,
                    .second_right = 34,
                    .difference = {0.25, {-0.5, 1e-300}},
                    .p_holm = 0.625},
                   {.first = 1,
                    .second = 0,
                    .first_right = 1,
                    .second_right = 2,
                    .difference = {-0.25, {-0.5, -1e-300}},
                    .p_holm = 0.03},
                   {.first = 0,
                    .second = 1,
                    .first_right = 0,
                    .second_right = 2,
                    .difference = {-1, {kNone, kNone}},
                    .p_holm = kNone}};
    return score;
}

TEST(ScoreTables, Scores) {
    EXPECT_EQ(written(write_scores, two_metrics()),
              "metric,majorities,majorities_low,majorities_high,votes,votes_low,votes_high,slope,"
              "slope_low,slope_high,log_likelihood_per_vote,log_likelihood_per_vote_low,"
              "log_likelihood_per_vote_high,log_likelihood,ties,undecided,zero_distances,selected,"
              "fitted\n"
              "\"a,b\",0.75,0.5,1,0.625,0.25,0.75,inf,1.5,2,-0.5,-1,-0.25,-100,1,2,3,1,0\n"
              "=c,,,,0.5,,,0,,,-0.7,,,-7,0,0,0,0,1\n");
}

TEST(ScoreTables, Pairs) {
    EXPECT_EQ(written(write_pair_scores, two_metrics()),
              "metric_1,metric_2,right_1,right_2,difference,difference_low,difference_high,"
              "clear_of_0,p_holm\n"
              "\"a,b\",=c,29,34,0.25,-0.5,1e-300,0,0.625\n"
              "=c,\"a,b\",1,2,-0.25,-0.5,-1e-300,1,0.03\n"
              "\"a,b\",=c,0,2,-1,,,0,\n");
}

}  // namespace
}  // namespace merl::scan
