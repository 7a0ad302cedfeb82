#include "scan/score/ratings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<std::string> kMaterials = {"abc/gold",      "abc/silk", "measured/gold",
                                             "measured/silk", "sgd/gold", "sgd/silk"};

Ratings resolve(const std::string& rows, const RatingNaming& naming = {.reference = "measured"},
                const std::vector<std::string>& materials = kMaterials) {
    return resolve_ratings(parse_ratings("original,approximation,rating\n" + rows, "r.csv"), naming,
                           materials);
}

std::string complaint(const std::string& rows,
                      const RatingNaming& naming = {.reference = "measured"}) {
    try {
        resolve(rows, naming);
    } catch (const InputError& error) {
        return error.what();
    }
    return "none";
}

std::vector<std::string> texts(const Ratings& ratings,
                               const std::vector<std::string>& materials = kMaterials) {
    std::vector<std::string> result;
    for (const auto& rated : ratings.list) {
        result.push_back(fmt::format("{} {} ({}) {} of {}", materials[rated.original],
                                     materials[rated.approximation], ratings.names[rated.name],
                                     rated.rating, rated.ratings));
    }
    return result;
}

TEST(Ratings, LabelsAndFullNames) {
    const auto expected =
        ElementsAre("measured/gold abc/gold (abc) 1 of 1", "measured/gold sgd/gold (sgd) 2 of 1",
                    "measured/silk sgd/silk (sgd) 3 of 1");
    EXPECT_THAT(texts(resolve("silk,sgd,3\ngold,sgd,2\ngold,abc,1\n")), expected);
    const std::string full =
        "measured/silk,sgd/silk,3\nmeasured/gold,sgd,2\nmeasured/gold,abc/gold,1\n";
    EXPECT_THAT(texts(resolve(full)), expected);
    EXPECT_THAT(texts(resolve(full, {})), expected);
    EXPECT_THAT(
        texts(resolve("Seide,SGD,3\nGOLD,SGD,2\nGOLD,a,1\n", {.reference = "measured",
                                                              .names = {{"GOLD", "gold"},
                                                                        {"SGD", "sgd"},
                                                                        {"Seide", "measured/silk"},
                                                                        {"a", "abc/gold"},
                                                                        {"b", "x"}}})),
        expected);
    // In a table names need no slash.
    const std::vector<std::string> plain = {"gold", "gold sgd", "gold ward"};
    EXPECT_THAT(
        texts(resolve("gold,gold sgd,1\ngold,gold ward,2\n", {}, plain), plain),
        ElementsAre("gold gold sgd (gold sgd) 1 of 1", "gold gold ward (gold ward) 2 of 1"));
}

TEST(Ratings, SeveralOfOneApproximationAreAveraged) {
    const auto ratings = resolve(
        "gold,sgd,5\nmeasured/gold,sgd/gold,2\ngold,abc,0.1\ngold,sgd,2\ngold,abc,0.7\n"
        "silk,abc,0.5\nsilk,sgd,0.3\nsilk,sgd,0.5\n");
    EXPECT_THAT(texts(ratings), ElementsAre("measured/gold abc/gold (abc) 0.4 of 2",
                                            "measured/gold sgd/gold (sgd) 3 of 3",
                                            "measured/silk abc/silk (abc) 0.5 of 1",
                                            "measured/silk sgd/silk (sgd) 0.4 of 2"));
    // As decimals they are equal; (0.1 + 0.7) / 2 and (0.3 + 0.5) / 2 are not, in float64.
    EXPECT_EQ(ratings.list[0].rating, ratings.list[3].rating);
    EXPECT_EQ(ratings.rows, 8U);
}

TEST(Ratings, WhatIsUnknownIsCounted) {
    const auto ratings = resolve(
        "gold,SGD,1\ngold,ward,2\ngold,sgd,2\nsilk,abc,3\nwood,sgd,1\nwood,abc,1\nsilk,sgd,9\n",
        {.reference = "measured", .names = {{"Phong", "phong"}}});
    EXPECT_EQ(ratings.rows_with_unknown, 4U);
    EXPECT_THAT(ratings.unknown,
                ElementsAre(UnknownRated{"SGD", 1, "sgd"}, UnknownRated{"ward", 1, ""},
                            UnknownRated{"wood", 2, ""}));
    EXPECT_THAT(ratings.unused_names, ElementsAre("Phong"));
    // Of a label that is there the material is missing.
    const std::vector<std::string> few = {"abc/gold", "measured/gold", "measured/silk", "sgd/gold"};
    EXPECT_THAT(
        resolve("gold,abc,1\ngold,sgd,2\nsilk,sgd,3\n", {.reference = "measured"}, few).unknown,
        ElementsAre(UnknownRated{"sgd/silk", 1, ""}));
}

TEST(Ratings, OfAnOriginalItself) {
    const auto ratings =
        resolve("gold,gold,5\ngold,measured,5\ngold,measured/gold,5\ngold,abc,1\ngold,sgd,2\n");
    EXPECT_EQ(ratings.rows_of_originals, 3U);
    EXPECT_EQ(ratings.list.size(), 2U);
    EXPECT_THAT(complaint("gold,gold,5\n"), HasSubstr("rates an original itself"));
}

TEST(Ratings, NothingLeft) {
    EXPECT_THAT(
        complaint("Gold,sgd,1\nsilk,SGD,2\n"),
        AllOf(HasSubstr("r.csv: each of the 2 rows"),
              HasSubstr("2 such: \"Gold\" (there is \"abc/gold\"), \"SGD\" (there is \"sgd\")"),
              HasSubstr("--names")));
    EXPECT_THAT(complaint("gold,sgd,1\n", {}), HasSubstr("--reference LABEL"));
    EXPECT_THAT(complaint("gold,sgd,1\n", {.reference = "sgd"}), HasSubstr("an original itself"));
    try {
        resolve("gold,sgd,1\n", {.reference = "Measured"});
        ADD_FAILURE() << "a label that there is not was taken";
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::usage);
        EXPECT_THAT(error.what(), HasSubstr("\"Measured\"; expected the label of a database: abc, "
                                            "measured, sgd"));
    }
}

TEST(Ratings, WithoutVariation) {
    EXPECT_THAT(complaint("gold,sgd,3\ngold,abc,3\nsilk,abc,3.0\n"),
                HasSubstr("found 3 rated approximations, all with the rating 3"));
    EXPECT_THAT(complaint("gold,sgd,3\ngold,sgd,4\n"),
                HasSubstr("found 1 rated approximation, with the rating 3.5"));
}

TEST(Ratings, WhatMayBeTwoThingsIsRefused) {
    const std::vector<std::string> both = {"a", "b", "b/a", "m/a"};
    EXPECT_THROW(resolve("a,b,1\n", {}, both), InputError);
    EXPECT_THROW(resolve("a,b/a,1\n", {.reference = "m"}, both), InputError);
    EXPECT_EQ(resolve("a,m,1\na,b/a,2\n", {}, both).list.size(), 2U);
}

TEST(Ratings, PairsAreAscendingAndThereOnce) {
    const std::vector<std::string> names = {"a", "b", "c"};
    const auto ratings = resolve("c,a,1\na,c,2\nb,a,3\n", {}, names);
    EXPECT_EQ(ratings.list.size(), 3U);
    EXPECT_THAT(rated_pairs(ratings), ElementsAre(Pair{0, 1}, Pair{0, 2}));
}

}  // namespace
}  // namespace merl::scan
