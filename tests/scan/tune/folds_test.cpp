#include "scan/tune/folds.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "tests/scan/tune/made_up_judges.h"

namespace merl::scan {
namespace {

using testing::MadeUpMaterials;

std::set<std::uint32_t> materials_in(const Judgements& judgements, const auto& takes) {
    std::set<std::uint32_t> found;
    for (const auto& judgement : judgements.list) {
        const auto materials = materials_of(judgement, judgements.materials);
        if (takes(materials)) {
            found.insert(materials.all().begin(), materials.all().end());
        }
    }
    return found;
}

/// Four materials in each, no reference.
Judgements without_reference(std::uint32_t materials) {
    JudgementFile file{"votes", "configuration CSV", {}, {}};
    for (std::uint32_t m = 0; m < materials; ++m) {
        file.names.push_back(std::to_string(1000 + m));
    }
    std::mt19937_64 random(1);
    while (file.rows.size() < 3000) {
        std::set<std::uint32_t> drawn;
        while (drawn.size() < 4) {
            drawn.insert(static_cast<std::uint32_t>(random() % materials));
        }
        const std::vector<std::uint32_t> four(drawn.begin(), drawn.end());
        file.rows.push_back({four[0], four[3], four[1], four[2], 2, 0, 1});
    }
    return resolve_judgements(file, file.names);
}

TEST(Folds, OfMaterialsShareNoneBetweenFittingAndTesting) {
    for (const auto& judgements : {MadeUpMaterials(30).judged(1, 2, 5), without_reference(20)}) {
        const auto folds = make_folds(FoldKind::materials, judgements, 1);
        ASSERT_FALSE(folds.empty());
        for (const auto& fold : folds) {
            const auto tested =
                materials_in(judgements, [&](const auto& m) { return fold.tests(m); });
            const auto trained =
                materials_in(judgements, [&](const auto& m) { return fold.trains(m); });
            ASSERT_FALSE(tested.empty());
            ASSERT_FALSE(trained.empty());
            std::vector<std::uint32_t> both;
            std::ranges::set_intersection(tested, trained, std::back_inserter(both));
            EXPECT_TRUE(both.empty());
        }
    }
}

TEST(Folds, OfMaterialsTestEveryJudgement) {
    // 8 choose 3, and 8 choose 4.
    const auto with = MadeUpMaterials(30).judged(1, 2, 5);
    const auto without = without_reference(20);
    EXPECT_EQ(make_folds(FoldKind::materials, with, 1).size(), 56);
    EXPECT_EQ(make_folds(FoldKind::materials, without, 1).size(), 70);
    for (const auto& judgements : {with, without}) {
        const auto folds = make_folds(FoldKind::materials, judgements, 1);
        for (const auto& judgement : judgements.list) {
            const auto materials = materials_of(judgement, judgements.materials);
            EXPECT_TRUE(
                std::ranges::any_of(folds, [&](const auto& f) { return f.tests(materials); }));
        }
    }
}

TEST(Folds, OfReferencesTestEveryJudgementOnceAndFitOnAllOthers) {
    for (const auto& judgements : {MadeUpMaterials(30).judged(1, 2, 5), without_reference(20)}) {
        const auto folds = make_folds(FoldKind::references, judgements, 1);
        EXPECT_EQ(folds.size(), 10);
        for (const auto& judgement : judgements.list) {
            const auto materials = materials_of(judgement, judgements.materials);
            EXPECT_EQ(
                std::ranges::count_if(folds, [&](const auto& f) { return f.tests(materials); }), 1);
            for (const auto& fold : folds) {
                EXPECT_NE(fold.tests(materials), fold.trains(materials));
            }
        }
    }
}

TEST(Folds, AreAsEvenAsTheyCanBe) {
    for (const auto& fold :
         make_folds(FoldKind::references, MadeUpMaterials(34).judged(1, 2, 5), 3)) {
        const auto left_out = std::ranges::count(fold.left_out, true);
        EXPECT_TRUE(left_out == 3 || left_out == 4) << left_out;
    }
}

TEST(Folds, AreByLotAndTheSameForTheSameSeed) {
    const auto judgements = MadeUpMaterials(30).judged(1, 2, 5);
    for (const auto kind : {FoldKind::references, FoldKind::materials}) {
        const auto left_out = [&](std::uint64_t seed) {
            std::vector<std::vector<bool>> all;
            for (const auto& fold : make_folds(kind, judgements, seed)) {
                all.push_back(fold.left_out);
            }
            return all;
        };
        EXPECT_EQ(left_out(1), left_out(1));
        EXPECT_NE(left_out(1), left_out(2));
    }
}

TEST(Folds, AreNotThereWithoutAnythingToFitOnOrToTest) {
    // Of five materials every fold leaves two, of which there is no judgement.
    EXPECT_TRUE(make_folds(FoldKind::materials, MadeUpMaterials(5).judged(1, 2, 5), 1).empty());
    EXPECT_FALSE(make_folds(FoldKind::materials, MadeUpMaterials(7).judged(1, 2, 5), 1).empty());
    JudgementFile file{"votes", "reference CSV", {"a", "b", "c", "d"}, {}};
    file.rows = {{0, 1, 0, 2, 3, 0, 1}, {0, 1, 0, 3, 3, 0, 1}};  // one reference
    EXPECT_TRUE(make_folds(FoldKind::references, resolve_judgements(file, file.names), 1).empty());
    file.rows = {{0, 1, 0, 2, 1, 0, 1}, {1, 2, 1, 3, 2, 0, 2}};  // no majority
    EXPECT_TRUE(make_folds(FoldKind::references, resolve_judgements(file, file.names), 1).empty());
}

}  // namespace
}  // namespace merl::scan
