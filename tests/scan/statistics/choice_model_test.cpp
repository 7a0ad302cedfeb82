#include "scan/statistics/choice_model.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

namespace merl::scan {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

ChoiceModel fit(const std::vector<Choice>& choices) {
    return fit_choice_model(choices);
}

const std::vector<Choice> kChoices = {{0.1, 3, 2},  {0.5, 4, 1}, {1.2, 5, 0}, {2.0, 4.5, 0.5},
                                      {0.05, 1, 3}, {0.7, 2, 2}, {3.0, 9, 1}, {0.0, 1, 4}};

// The expected numbers are the root of the derivative by scipy.optimize.brentq (scipy 1.10.1).
TEST(ChoiceModel, IsThatOfScipy) {
    const auto model = fit(kChoices);
    EXPECT_NEAR(model.slope, 0.9953308015537069, 1e-14);
    EXPECT_NEAR(model.log_likelihood, -22.03152302608783, 1e-13);
    double chance = 0;
    for (const auto& choice : kChoices) {
        chance += log_likelihood(choice, 0);
    }
    EXPECT_NEAR(chance, -29.805328764077647, 1e-13);  // 43 votes, ln 1/2
}

TEST(ChoiceModel, DerivativesAreThoseOfTheLikelihood) {
    for (const double slope : {-2.0, 0.0, 0.7}) {
        for (const auto& choice : kChoices) {
            constexpr double h = 1e-4;
            const double before = log_likelihood(choice, slope - h);
            const double after = log_likelihood(choice, slope + h);
            const auto [gradient, curvature] = derivatives(choice, slope);
            EXPECT_NEAR(gradient, (after - before) / (2 * h), 1e-6);
            EXPECT_NEAR(-curvature, (after - 2 * log_likelihood(choice, slope) + before) / (h * h),
                        1e-5);
        }
    }
}

TEST(ChoiceModel, AgainstTheMetricIsNegative) {
    auto swapped = kChoices;
    for (auto& choice : swapped) {
        std::swap(choice.with, choice.against);
    }
    EXPECT_NEAR(fit(swapped).slope, -0.9953308015537069, 1e-14);
    EXPECT_NEAR(fit(swapped).log_likelihood, -22.03152302608783, 1e-13);
}

TEST(ChoiceModel, APowerOfTheMetricDividesTheSlope) {
    for (const double power : {1e-12, 0.01, 3.0, 700.0}) {
        auto powered = kChoices;
        for (auto& choice : powered) {
            choice.log_ratio *= power;
        }
        EXPECT_NEAR(fit(powered).slope * power, 0.9953308015537069, 1e-13) << power;
    }
}

// With one ratio z, the slope is ln(with / against) / z.
TEST(ChoiceModel, OneRatioHasAFormula) {
    EXPECT_NEAR(fit({{2, 3, 1}}).slope, std::log(3) / 2, 1e-15);
    EXPECT_NEAR(fit({{2, 1e9, 1}}).slope, std::log(1e9) / 2, 1e-12);
    EXPECT_NEAR(fit({{1e-3, 1, 1e9}}).slope, -std::log(1e9) * 1e3, 1e-8);
    EXPECT_EQ(fit({{2, 5, 5}}).slope, 0);
}

TEST(ChoiceModel, SeparationIsInfinite) {
    const auto with = fit({{2, 3, 0}, {0.1, 1, 0}, {0, 2, 5}});
    EXPECT_EQ(with.slope, kInfinity);
    EXPECT_DOUBLE_EQ(with.log_likelihood, -7 * std::numbers::ln2);
    const auto against = fit({{2, 0, 3}, {0, 1, 0}});
    EXPECT_EQ(against.slope, -kInfinity);
    EXPECT_DOUBLE_EQ(against.log_likelihood, -std::numbers::ln2);
    const auto nothing = fit({{0, 1, 3}, {2, 0, 0}});
    EXPECT_EQ(nothing.slope, 0);
    EXPECT_DOUBLE_EQ(nothing.log_likelihood, -4 * std::numbers::ln2);
    EXPECT_EQ(fit({}).slope, 0);
}

// Simulated judges who choose as the model says. The tolerance is 4.5 standard errors, from the
// information n z^2 p (1 - p).
TEST(ChoiceModel, ASimulatedSlopeIsRecovered) {
    for (const double slope : {0.0, 0.3, 1.0, 4.0, -1.5}) {
        std::mt19937_64 random(static_cast<std::uint64_t>(slope * 10 + 100));
        std::exponential_distribution<double> ratio(1);
        std::uniform_real_distribution<double> uniform;
        std::vector<Choice> choices;
        double information = 0;
        for (int i = 0; i < 5000; ++i) {
            Choice choice{ratio(random), 0, 0};
            const double p = 1 / (1 + std::exp(-slope * choice.log_ratio));
            for (int vote = 0; vote < 5; ++vote) {
                (uniform(random) < p ? choice.with : choice.against) += 1;
            }
            information += 5 * choice.log_ratio * choice.log_ratio * p * (1 - p);
            choices.push_back(choice);
        }
        EXPECT_NEAR(fit(choices).slope, slope, 4.5 / std::sqrt(information)) << slope;
    }
}

}  // namespace
}  // namespace merl::scan
