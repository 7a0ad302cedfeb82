#include "scan/tune/tune.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <cstdio>
#include <random>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "scan/tune/tune_tables.h"
#include "tests/scan/support.h"
#include "tests/scan/tune/made_up_judges.h"

namespace merl::scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::MadeUpMaterials;

const std::vector<TuneParameter> kWeight = {{"weight", 0.1, 0, 10}};

/// What a writer writes.
std::string written(const std::function<void(int)>& write) {
    std::FILE* file = std::tmpfile();
    write(::fileno(file));
    std::rewind(file);
    std::string text;
    for (int c = std::fgetc(file); c != EOF; c = std::fgetc(file)) {
        text += static_cast<char>(c);
    }
    std::fclose(file);
    return text;
}

std::string all_tables(const Tuning& tuning, const std::vector<std::string>& names) {
    return written([&](int file) { write_tuning(file, tuning); }) +
           written([&](int file) { write_parameters(file, tuning); }) +
           written([&](int file) { write_folds(file, tuning, names); });
}

/// The same judgements, with votes by the toss of a coin.
Judgements coin(Judgements judgements) {
    std::mt19937_64 random(3);
    for (auto& judgement : judgements.list) {
        judgement.votes_left = random() % 4;
        judgement.votes_right = 3 - judgement.votes_left;
    }
    return judgements;
}

TEST(Tune, FindsTheSameOnEveryPartOfConsistentJudgements) {
    const MadeUpMaterials materials(16);
    const auto judgements = materials.judged(2, 1.5, 100'000);
    const auto tuning = tune(judgements, kWeight, materials.distances_at(), {});
    EXPECT_NEAR(tuning.fit.values[0], 2, 0.02);
    for (const auto* validation : {&tuning.by_reference, &tuning.by_materials}) {
        EXPECT_EQ(validation->scores.judgements, judgements.list.size());
        for (const auto& fold : validation->folds) {
            EXPECT_NEAR(fold.fit.values[0], 2, 0.02);
            EXPECT_NEAR(fold.fit.slope, 1.5, 0.02);
        }
        // What is not seen is predicted as well.
        EXPECT_NEAR(validation->scores.second.majorities.value, 1, 0.01);
        EXPECT_NEAR(validation->scores.second.log_likelihood.value,
                    tuning.scores.second.log_likelihood.value, 1e-4);
        EXPECT_GT(validation->scores.gain.log_likelihood.interval.low, 0);
    }
    EXPECT_TRUE(doubts(tuning).empty());
}

TEST(Tune, HasTheFiguresOfScore) {
    const MadeUpMaterials materials(14);
    auto judgements = coin(materials.judged(2, 1.5, 3));
    const auto tuning = tune(judgements, kWeight, materials.distances_at(), {});
    const auto before = materials.distances(0.1);
    const auto after = materials.distances(tuning.fit.values[0]);
    const std::vector<ScoredMetric> metrics = {{"before", before}, {"after", after}};
    auto expected = score(judgements, metrics);
    limit_to_own_order(expected);
    EXPECT_EQ(tuning.start_slope, expected.metrics[0].slope.value);
    EXPECT_EQ(tuning.fit.slope, expected.metrics[1].slope.value);
    const auto same = [](const Estimate& a, const Estimate& b) {
        EXPECT_NEAR(a.value, b.value, 1e-14);
        if (b.too_few.empty()) {
            EXPECT_NEAR(a.interval.low, b.interval.low, 1e-13);
            EXPECT_NEAR(a.interval.high, b.interval.high, 1e-13);
        }
    };
    for (const auto& [found, metric] : {std::pair{&tuning.scores.first, &expected.metrics[0]},
                                        {&tuning.scores.second, &expected.metrics[1]}}) {
        same(found->majorities, metric->majorities);
        same(found->votes, metric->votes);
        same(found->log_likelihood, metric->log_likelihood);
    }
    same(tuning.scores.gain.majorities, negative(expected.pairs[0].difference));
}

TEST(Tune, CrossValidatesWithWhatTheFitsOfFoldsSay) {
    const MadeUpMaterials materials(12);
    const auto judgements = coin(materials.judged(2, 1.5, 3));
    const auto tuning = tune(judgements, kWeight, materials.distances_at(), {});
    for (const auto* validation : {&tuning.by_reference, &tuning.by_materials}) {
        // Word by word: each judgement has the mean of the tests that it is in.
        double right = 0;
        double untied = 0;
        double likelihood = 0;
        double votes = 0;
        for (const auto& judgement : judgements.list) {
            const auto judged = materials_of(judgement, judgements.materials);
            double said_left = 0;
            double log_likelihood_of_tests = 0;
            double times = 0;
            for (const auto& fold : validation->folds) {
                if (!fold.fold.tests(judged)) {
                    continue;
                }
                const auto d = materials.distances(fold.fit.values[0]);
                const double slope = std::max(fold.fit.slope, 0.0);
                const double p = 1 / (1 + std::pow(d[judgement.left] / d[judgement.right], slope));
                said_left += d[judgement.left] < d[judgement.right] ? 1 : 0;
                log_likelihood_of_tests +=
                    static_cast<double>(judgement.votes_left) * std::log(p) +
                    static_cast<double>(judgement.votes_right) * std::log1p(-p);
                ++times;
            }
            ASSERT_GT(times, 0);
            likelihood += log_likelihood_of_tests / times;
            votes += static_cast<double>(judgement.votes());
            if (judgement.untied()) {
                ++untied;
                const double left = said_left / times;
                right += judgement.votes_left > judgement.votes_right ? left : 1 - left;
            }
        }
        EXPECT_NEAR(validation->scores.second.majorities.value, right / untied, 1e-12);
        EXPECT_NEAR(validation->scores.second.log_likelihood.value, likelihood / votes, 1e-12);
    }
}

TEST(Tune, DependsOnTheSeedAndNotOnThreads) {
    const MadeUpMaterials materials(12);
    const auto judgements = coin(materials.judged(2, 1.5, 3));
    const std::vector<std::string> names(12, "m");
    const auto tables = [&](int threads, bool at_once, std::uint64_t seed) {
        std::string text;
        testing::with_threads(threads, [&] {
            text = all_tables(tune(judgements, kWeight, materials.distances_at(),
                                   {.fit = {.evaluations = 100, .seed = seed}, .at_once = at_once}),
                              names);
        });
        return text;
    };
    const auto expected = tables(1, true, 1);
    EXPECT_EQ(tables(4, true, 1), expected);
    EXPECT_EQ(tables(4, false, 1), expected);
    EXPECT_NE(tables(4, true, 2), expected);
}

TEST(Tune, DoubtsWhatNothingSpeaksFor) {
    const MadeUpMaterials materials(12);
    const auto tossed = coin(materials.judged(2, 1.5, 3));
    EXPECT_THAT(doubts(tune(tossed, kWeight, materials.distances_at(), {})),
                ElementsAre(HasSubstr("left out")));

    const MadeUpMaterials few(5);
    const auto tuning = tune(few.judged(2, 1.5, 9), kWeight, few.distances_at(), {});
    EXPECT_TRUE(tuning.by_materials.folds.empty());
    EXPECT_THAT(doubts(tuning), ElementsAre(HasSubstr("too few materials")));

    auto one = few.judged(2, 1.5, 9);
    one.list.resize(3);
    EXPECT_THAT(doubts(tune(one, kWeight, few.distances_at(), {})),
                ElementsAre(HasSubstr("3 configurations with a majority are too few for 1"),
                            HasSubstr("too few materials")));
}

TEST(Tune, NeedsNoMoreEvaluationsThanItSays) {
    const MadeUpMaterials materials(12);
    const auto judgements = materials.judged(2, 1.5, 3);
    for (const std::uint32_t most : {1U, 7U, 40U}) {
        std::atomic<std::uint64_t> calls = 0;
        const TuneOptions options = {.fit = {.evaluations = most}};
        const auto tuning = tune(
            judgements, kWeight,
            [&](std::span<const double> values) {
                ++calls;
                return materials.distances(values[0]);
            },
            options);
        EXPECT_EQ(tuning.evaluations, calls);
        EXPECT_LE(calls, most_evaluations(judgements, options.fit));
        EXPECT_EQ(tuning.fits,
                  1 + tuning.by_reference.folds.size() + tuning.by_materials.folds.size());
        EXPECT_EQ(tuning.cut_short, tuning.fits);
    }
}

TEST(Tune, ShowsProgressAndEndsWhenThatThrows) {
    const MadeUpMaterials materials(12);
    const auto judgements = materials.judged(2, 1.5, 3);
    double last = 0;
    const auto look = [&](double share) {
        EXPECT_GE(share, last);
        last = share;
    };
    EXPECT_EQ(tune(judgements, kWeight, materials.distances_at(), {}, look).cut_short, 0);
    EXPECT_NEAR(last, 1, 1e-9);
    EXPECT_THROW(tune(judgements, kWeight, materials.distances_at(), {},
                      [](double) { throw std::runtime_error("stop"); }),
                 std::runtime_error);
}

TEST(Tune, WritesTables) {
    const MadeUpMaterials materials(12);
    const auto judgements = materials.judged(2, 1.5, 30);
    std::vector<std::string> names;
    for (int m = 0; m < 12; ++m) {
        names.push_back(m == 0 ? "a, \"b\"" : "m" + std::to_string(m));
    }
    const auto tuning = tune(judgements, kWeight, materials.distances_at(), {});
    const auto lines = [](const std::string& text) { return std::ranges::count(text, '\n'); };
    EXPECT_EQ(lines(written([&](int file) { write_tuning(file, tuning); })), 10);
    EXPECT_EQ(lines(written([&](int file) { write_parameters(file, tuning); })), 2);
    const auto folds = written([&](int file) { write_folds(file, tuning, names); });
    EXPECT_EQ(lines(folds), 1 + 10 + 56);
    EXPECT_THAT(folds, HasSubstr("\"a, \"\"b\"\" | "));
    EXPECT_THAT(folds, HasSubstr("\n1,references,"));
    EXPECT_THAT(folds, HasSubstr("\n66,materials,"));
}

}  // namespace
}  // namespace merl::scan
