#include "scan/score/rating_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/base/error.h"

namespace merl::scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;

void expect_refused(const std::string& text, const std::vector<std::string>& words,
                    std::optional<RatingScale> scale = std::nullopt) {
    try {
        parse_ratings(text, "r.csv", scale);
        ADD_FAILURE() << "taken: " << text;
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), ::testing::StartsWith("r.csv, line "));
        for (const auto& word : words) {
            EXPECT_THAT(error.what(), HasSubstr(word)) << text;
        }
    }
}

std::string row_text(const RatingFile& file, std::size_t row) {
    const auto& r = file.rows.at(row);
    return fmt::format("{} {} {}", file.names.at(r.original), file.names.at(r.approximation),
                       r.rating);
}

TEST(RatingFile, RatingsAndDifferences) {
    const auto ratings = parse_ratings("original,approximation,rating\ngold,sgd,-1.5\n", "r.csv");
    EXPECT_TRUE(ratings.higher_is_better);
    EXPECT_EQ(ratings.format, "ratings CSV");
    EXPECT_FALSE(ratings.scale);
    EXPECT_EQ(row_text(ratings, 0), "gold sgd -1.5");
    const auto differences = parse_ratings(
        "who,difference,approximation,original\nann,3,sgd,gold\nbob,1,sgd,silk\n", "r.csv");
    EXPECT_FALSE(differences.higher_is_better);
    EXPECT_THAT(differences.names, ElementsAre("gold", "sgd", "silk"));
    EXPECT_EQ(row_text(differences, 1), "silk sgd 1");
}

// The rows of SPEC §12, of the shape that Lavoué et al. 2021 published.
TEST(RatingFile, Lavoue) {
    const auto file = parse_ratings(
        "\"METHOD\";\"BRDF\";\"DISTANCE\"\n\"ABC\";\"alum-bronze\";0.216666666666667\n"
        "\"SGD\";\"alum-bronze\";0.341666666666667\n",
        "r.csv");
    EXPECT_EQ(file.format, "Lavoué 2021");
    EXPECT_FALSE(file.higher_is_better);
    ASSERT_TRUE(file.scale);
    EXPECT_EQ(file.scale->high, 1);
    EXPECT_EQ(row_text(file, 1), "alum-bronze SGD 0.341666666666667");
    expect_refused("METHOD;BRDF;DISTANCE\nA;x;1.5\n", {"DISTANCE: found 1.5", "from 0 to 1"});
    // As a spreadsheet in German makes it.
    EXPECT_EQ(row_text(parse_ratings("METHOD;BRDF;DISTANCE;\r\nA;x;0,25;\r\n;;;\r\n", "r.csv"), 0),
              "x A 0.25");
}

TEST(RatingFile, Scale) {
    const std::string text = "original,approximation,rating\na,m,1\na,n,5\n";
    EXPECT_EQ(parse_ratings(text, "r.csv", RatingScale{1, 5}).rows.size(), 2U);
    expect_refused(text, {"line 3", "rating: found 5; expected a number from 1 to 4", "--scale"},
                   RatingScale{1, 4});
    expect_refused(text, {"line 2", "found 1"}, RatingScale{1.5, 5});
}

TEST(RatingFile, BadFilesAreExplained) {
    const std::string header = "original,approximation,rating\n";
    expect_refused("\n", {"header"});
    expect_refused(header, {"no row", "expected a rating"});
    expect_refused("original,approximation,mos\n", {"original,approximation,mos", "difference"});
    expect_refused("original,approximation,rating,difference\n",
                   {"\"rating\" and \"difference\"", "expected one"});
    expect_refused("original,approximation,rating,rating\n", {"\"rating\" twice"});
    expect_refused(header + "a,m\n", {"line 2", "2 fields"});
    expect_refused(header + "a,m,1,5\n", {"line 2", "4 fields", "decimal comma"});
    expect_refused(header + ",m,1\n", {"original: found no name"});
    expect_refused(header + "a,,1\n", {"approximation: found no name"});
    for (const auto* rating : {"nan", "inf", "-inf", "1e999", "good", " 1", "+1"}) {
        expect_refused(fmt::format("{}a,m,{}\n", header, rating),
                       {"line 2", fmt::format("rating: found \"{}\"", rating), "finite number"});
    }
    expect_refused(header + "a,m,-1.1e100\n", {"line 2", "at most 1e+100 in size"});
    expect_refused(header + "a,m,\n", {"rating: found nothing", "or no such row"});
    expect_refused("original;approximation;rating\na;m;0,5\na;n;1.5\n",
                   {"line 3", "one decimal mark"});
}

TEST(RatingNames, Names) {
    EXPECT_THAT(parse_rating_names("name_in_ratings,name\nSGD,sgd\nWARD,ward\nSGD,sgd\n", "n.csv"),
                ElementsAre(Pair("SGD", "sgd"), Pair("WARD", "ward")));
    for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
             {"a,b\n", "expected \"name_in_ratings,name\""},
             {"name_in_ratings,name\n", "no row"},
             {"name_in_ratings,name\nSGD,\n", "no name"},
             {"name_in_ratings,name\nSGD,a\nSGD,b\n", "found \"b\" for \"SGD\", which is \"a\""}}) {
        try {
            parse_rating_names(text, "n.csv");
            ADD_FAILURE() << "taken: " << text;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), HasSubstr(words));
        }
    }
}

}  // namespace
}  // namespace merl::scan
