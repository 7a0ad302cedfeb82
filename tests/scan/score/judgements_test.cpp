#include "scan/score/judgements.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/pairs/pairs.h"

namespace merl::scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<std::string> kMaterials = {"a", "b", "c", "d", "e"};

std::uint32_t pair(std::uint32_t first, std::uint32_t second) {
    return pair_index({first, second}, 5);
}

/// Names of the file are in an order of their own: e d c b a x y.
JudgementFile file_of(std::vector<NamedVotes> rows) {
    return {"votes", "reference CSV", {"e", "d", "c", "b", "a", "x", "y"}, std::move(rows)};
}

constexpr std::uint32_t E = 0, D = 1, C = 2, B = 3, A = 4, X = 5, Y = 6;

TEST(Judgements, AddsUpRowsOnTheSameConfiguration) {
    const auto judgements =
        resolve_judgements(file_of({{A, B, A, C, 3, 1, 0},    // the same configuration, shown
                                    {C, A, B, A, 5, 0, 2},    // the other way round
                                    {B, C, B, A, 1, 0, 0}}),  // another
                           kMaterials);
    EXPECT_THAT(judgements.list, ElementsAre(Judgement{pair(0, 1), pair(0, 2), 5, 1, 5},
                                             Judgement{pair(0, 1), pair(1, 2), 0, 0, 1}));
    EXPECT_FALSE(judgements.list[0].untied());
    EXPECT_EQ(judgements.list[0].votes(), 11);
    EXPECT_EQ(judgements.rows, 3);
    EXPECT_EQ(judgements.rows_with_unknown, 0);
}

TEST(Judgements, TheSharedMaterialIsTheReference) {
    const auto judgements = resolve_judgements(file_of({{A, B, D, E, 1, 0, 0},
                                                        {E, A, E, B, 1, 0, 0},
                                                        {A, C, A, D, 1, 0, 0},
                                                        {D, A, C, D, 1, 0, 0}}),
                                               kMaterials);
    EXPECT_EQ(judgements.materials, 5);
    std::vector<std::vector<std::uint32_t>> materials;
    for (const auto& judgement : judgements.list) {
        const auto of_judgement = materials_of(judgement, 5);
        materials.emplace_back(of_judgement.all().begin(), of_judgement.all().end());
        EXPECT_EQ(of_judgement.has_reference, materials.back().size() == 3);
    }
    // ab|de, ac|ad, ad|cd, ae|be
    EXPECT_THAT(materials, ElementsAre(ElementsAre(0, 1, 3, 4), ElementsAre(0, 2, 3),
                                       ElementsAre(3, 0, 2), ElementsAre(4, 0, 1)));
}

TEST(Judgements, OrderAndSidesDoNotMatter) {
    std::vector<NamedVotes> rows = {
        {A, B, A, C, 3, 1, 0}, {E, A, E, B, 1, 2, 7}, {A, D, B, C, 0, 1, 4}};
    const auto expected = resolve_judgements(file_of(rows), kMaterials);
    std::ranges::reverse(rows);
    for (auto& row : rows) {
        row = {row.right_2,     row.right_1,     row.left_1,    row.left_2,
               row.votes_right, row.votes_equal, row.votes_left};
    }
    const auto judgements = resolve_judgements(file_of(rows), kMaterials);
    EXPECT_EQ(judgements.list, expected.list);
}

TEST(Judgements, UnknownMaterialsAreCountedAndListed) {
    const auto judgements = resolve_judgements(
        file_of({{A, B, A, Y, 3, 0, 0}, {X, Y, X, A, 1, 0, 0}, {A, B, A, C, 2, 0, 0}}), kMaterials);
    EXPECT_EQ(judgements.list.size(), 1);
    EXPECT_EQ(judgements.rows, 3);
    EXPECT_EQ(judgements.rows_with_unknown, 2);
    EXPECT_THAT(judgements.unknown, ElementsAre(UnknownMaterial{"x", 1}, UnknownMaterial{"y", 2}));
}

TEST(Judgements, WithoutAVoteAreNone) {
    const auto judgements = resolve_judgements(file_of({{A, B, A, C, 0, 0, 0},
                                                        {A, B, D, E, 0, 1, 0},
                                                        {A, C, D, E, 0, 0, 0},
                                                        {E, D, A, C, 0, 0, 0},
                                                        {C, A, B, A, 0, 0, 2}}),
                                               kMaterials);
    EXPECT_EQ(judgements.list.size(), 2);  // one of its two rows has votes
    EXPECT_EQ(judgements.without_votes, 1);
}

void expect_refused(const JudgementFile& file, const std::vector<std::string>& words) {
    try {
        resolve_judgements(file, kMaterials);
        ADD_FAILURE() << "taken";
    } catch (const InputError& error) {
        for (const auto& word : words) {
            EXPECT_THAT(error.what(), HasSubstr(word));
        }
    }
}

TEST(Judgements, NothingLeftIsAnError) {
    expect_refused(file_of({{A, B, A, Y, 3, 0, 0}, {X, A, X, C, 3, 0, 0}}),
                   {"votes: ", "2 rows", "\"x\", \"y\""});
    expect_refused(file_of({{A, B, A, C, 0, 0, 0}, {X, A, X, C, 3, 0, 0}}),
                   {"votes: ", "no vote", "1 rows"});
}

}  // namespace
}  // namespace merl::scan
