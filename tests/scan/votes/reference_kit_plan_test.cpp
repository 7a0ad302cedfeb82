#include "scan/votes/reference_kit_plan.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "scan/pairs/agreement.h"

namespace merl::scan {
namespace {

using ::testing::HasSubstr;

using List = std::vector<ApproximationDistances>;

/// So many originals, each with one to five approximations.
List made_up(std::uint32_t originals, std::uint32_t seed) {
    std::mt19937 random(seed);
    List list;
    for (std::uint32_t i = 0; i < originals; ++i) {
        const auto name = fmt::format("m{}", 1000 + i);
        for (std::uint32_t label = 0; label < 1 + (i + 4) % 5; ++label) {
            const double common = 1 + static_cast<double>(random() % 1000);
            const auto distance = [&] {
                return common * (1 + static_cast<double>(random() % 100) / 50);
            };
            list.push_back({.original = "o/" + name,
                            .approximation = fmt::format("{}/{}", "abcde"[label], name),
                            .first = distance(),
                            .second = distance()});
        }
    }
    return list;
}

using Two = std::pair<std::size_t, std::size_t>;

/// Every two approximations of one original on which the metrics disagree, word by word.
std::vector<Two> disagreements(const List& list) {
    std::vector<Two> found;
    for (std::size_t a = 0; a < list.size(); ++a) {
        for (std::size_t b = a + 1; b < list.size(); ++b) {
            if (list[a].original == list[b].original &&
                disagree(list[a].first, list[b].first, list[a].second, list[b].second)) {
                found.emplace_back(a, b);
            }
        }
    }
    return found;
}

/// The first so many of them, the nearer under the first metric on the left.
SelectionFile select_from(const List& list, std::size_t count) {
    SelectionFile file{
        .file = "selection.csv", .first_metric = "x", .second_metric = "y", .configurations = {}};
    for (auto [a, b] : disagreements(list)) {
        if (file.configurations.size() == count) {
            break;
        }
        if (list[a].first > list[b].first ||
            (list[a].first == list[b].first && list[a].second < list[b].second)) {
            std::swap(a, b);
        }
        file.configurations.push_back({.materials = {list[a].original, list[a].approximation,
                                                     list[b].original, list[b].approximation},
                                       .first = {list[a].first, list[b].first},
                                       .second = {list[a].second, list[b].second},
                                       .agreement = 0.5});
    }
    return file;
}

const ApproximationDistances& find(const List& list, const std::string& approximation) {
    return *std::ranges::find(list, approximation, &ApproximationDistances::approximation);
}

std::vector<KitTrial> of_kind(const std::vector<KitTrial>& trials, TrialKind kind) {
    std::vector<KitTrial> found;
    std::ranges::copy_if(trials, std::back_inserter(found),
                         [&](const auto& trial) { return trial.kind == kind; });
    return found;
}

template <typename Check>
std::string complaint(const Check& check) {
    try {
        check();
    } catch (const InputError& error) {
        return error.what();
    }
    return "";
}

TEST(ReferenceKitPlan, HasTheSelectionAndWhatWasAskedFor) {
    const auto list = made_up(40, 1);
    const auto selection = select_from(list, 15);
    const auto trials = plan_reference_kit(selection, list,
                                           {.seed = 7, .repeats = 10, .sentinels = 4, .random = 6});
    ASSERT_EQ(trials.size(), 15U + 4 + 6 + 2);
    for (std::size_t i = 0; i < 25; ++i) {
        EXPECT_EQ(trials[i].configuration, i + 1);
        EXPECT_EQ(trials[i].materials[0], trials[i].materials[2]);
    }
    for (std::size_t i = 0; i < 15; ++i) {
        EXPECT_EQ(trials[i].kind, TrialKind::selection);
        EXPECT_EQ(trials[i].materials, selection.configurations[i].materials);
    }
    for (const auto& repeat : of_kind(trials, TrialKind::repeat)) {
        EXPECT_EQ(repeat.materials, trials.at(repeat.configuration - 1).materials);
    }
    EXPECT_EQ(
        plan_reference_kit(selection, {}, {.seed = 1, .repeats = 100, .sentinels = 0, .random = 0})
            .size(),
        30U);
    EXPECT_THROW(plan_reference_kit(selection, {}, {}), std::invalid_argument);
}

TEST(ReferenceKitPlan, ASentinelIsTheOriginalItselfAgainstAFarApproximation) {
    const auto list = made_up(60, 2);
    const auto selection = select_from(list, 3);
    // How many are nearer under the metric that says so most.
    const auto rank = [&](const ApproximationDistances& of) {
        const auto nearer = [&](double ApproximationDistances::*metric) {
            return std::ranges::count_if(list,
                                         [&](const auto& one) { return one.*metric < of.*metric; });
        };
        return std::min(nearer(&ApproximationDistances::first),
                        nearer(&ApproximationDistances::second));
    };
    std::vector<long> ranks;
    std::ranges::transform(list, std::back_inserter(ranks), rank);
    std::ranges::sort(ranks, std::greater{});
    std::set<int> expected;
    for (std::uint64_t seed = 0; seed < 10; ++seed) {
        const auto sentinels =
            of_kind(plan_reference_kit(selection, list,
                                       {.seed = seed, .repeats = 0, .sentinels = 5, .random = 0}),
                    TrialKind::sentinel);
        ASSERT_EQ(sentinels.size(), 5U);
        std::set<std::string> originals;
        for (const auto& [number, kind, m, side, agreement] : sentinels) {
            EXPECT_TRUE(originals.insert(m[0]).second);
            EXPECT_EQ(m[0], m[2]);
            EXPECT_EQ(side == 1 ? m[1] : m[3], m[0]);
            const auto& far = find(list, side == 1 ? m[3] : m[1]);
            EXPECT_EQ(far.original, m[0]);
            EXPECT_GE(rank(far), ranks[sentinel_approximations(list.size()) - 1]);
            EXPECT_FALSE(agreement.has_value());
            EXPECT_EQ(fault_of_trial(m, kind), "");
            expected.insert(side);
        }
    }
    EXPECT_EQ(expected, (std::set{1, 3}));
    EXPECT_EQ(sentinel_approximations(5000), 100U);
    EXPECT_EQ(sentinel_approximations(300), 20U);
    EXPECT_EQ(sentinel_approximations(9), 4U);
    // What a metric takes for the original tells nobody right from wrong.
    List copies = list;
    for (auto& one : copies) {
        one.second = 0;
    }
    EXPECT_TRUE(of_kind(plan_reference_kit(select_from(copies, 3), copies,
                                           {.seed = 1, .repeats = 0, .sentinels = 5, .random = 0}),
                        TrialKind::sentinel)
                    .empty());
}

TEST(ReferenceKitPlan, RandomOnesAreOtherDisagreementsWithEqualChances) {
    const auto list = made_up(12, 3);
    const auto selection = select_from(list, 2);
    const auto there_are = disagreements(list).size();
    ASSERT_GT(there_are, 10U);
    const auto all =
        of_kind(plan_reference_kit(selection, list,
                                   {.seed = 1, .repeats = 0, .sentinels = 0, .random = 1000}),
                TrialKind::random);
    EXPECT_EQ(all.size(), there_are - 2);
    std::map<FourMaterials, int> times;
    constexpr int kSeeds = 4000;
    for (int seed = 0; seed < kSeeds; ++seed) {
        const auto trial = plan_reference_kit(selection, list,
                                              {.seed = static_cast<std::uint64_t>(seed),
                                               .repeats = 0,
                                               .sentinels = 0,
                                               .random = 1})
                               .back();
        ++times[trial.materials];
        const auto& left = find(list, trial.materials[1]);
        const auto& right = find(list, trial.materials[3]);
        ASSERT_EQ(trial.materials[0], left.original);
        ASSERT_EQ(trial.materials[2], left.original);
        ASSERT_LE(left.first, right.first);
        ASSERT_GE(left.second, right.second);
        ASSERT_DOUBLE_EQ(*trial.agreement, left.first * right.second / (right.first * left.second));
    }
    // Chi-squared: mean n - 1, variance 2 (n - 1); five deviations.
    const auto n = static_cast<double>(all.size());
    double chi2 = 0;
    for (const auto& [materials, count] : times) {
        chi2 += std::pow(count - kSeeds / n, 2) / (kSeeds / n);
    }
    EXPECT_EQ(times.size(), all.size());
    EXPECT_LT(chi2, n - 1 + 5 * std::sqrt(2 * (n - 1)));
}

TEST(ReferenceKitPlan, PractiseIsOnTheOriginalItself) {
    const List list = {
        {"o/m", "a/m", 1, 9}, {"o/m", "b/m", 8, 8}, {"o/n", "a/n", 9, 1}, {"o/n", "b/n", 2, 2}};
    EXPECT_EQ(reference_practice(select_from(list, 2)),
              (FourMaterials{"o/n", "o/n", "o/n", "a/m"}));
    EXPECT_EQ(reference_practice(select_from(list, 1)),
              (FourMaterials{"o/m", "o/m", "o/m", "a/m"}));
}

TEST(ReferenceKitPlan, SelectionsOfAnotherKindAreRefused) {
    const auto list = made_up(8, 4);
    const auto selection = select_from(list, 3);
    const auto fault = [&](FourMaterials materials) {
        auto other = selection;
        other.configurations.at(1).materials = std::move(materials);
        return complaint([&] { expect_reference(other, "o"); });
    };
    EXPECT_EQ(fault({"o/m", "a/m", "o/m", "b/m"}), "");
    for (const auto& materials :
         {FourMaterials{"a/m", "o/m", "o/m", "b/m"}, FourMaterials{"o/m", "a/m", "o/n", "b/n"},
          FourMaterials{"o/m", "a/n", "o/m", "b/m"}, FourMaterials{"o/m", "o/m", "o/m", "b/m"},
          FourMaterials{"p/m", "a/m", "p/m", "b/m"}, FourMaterials{"m", "n", "m", "l"}}) {
        EXPECT_THAT(fault(materials), ::testing::AllOf(HasSubstr("selection.csv, row 2"),
                                                       HasSubstr("\"o/…\", first on both sides")));
    }
}

TEST(ReferenceKitPlan, DistancesOfAnotherScanAreRefused) {
    const auto list = made_up(8, 4);
    auto selection = select_from(list, 3);
    EXPECT_EQ(complaint([&] { expect_same_scan(selection, list, "a.csv"); }), "");
    auto changed = list;
    for (auto& one : changed) {
        one.second *= 1.5;
    }
    EXPECT_THAT(complaint([&] { expect_same_scan(selection, changed, "a.csv"); }),
                ::testing::AllOf(HasSubstr("a.csv"), HasSubstr("row 1")));
    selection.configurations.at(1).materials[3] = "x/y";
    EXPECT_THAT(complaint([&] { expect_same_scan(selection, list, "a.csv"); }),
                ::testing::AllOf(HasSubstr("\"x/y\""), HasSubstr("row 2")));
}

}  // namespace
}  // namespace merl::scan
