#include "scan/score/judgement_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/score/lagunas.h"

namespace merl::scan {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::vector<std::string> kNames = {"gold", "silk", "steel", "wood"};

JudgementFile parse(const std::string& text) {
    return parse_judgements(text, "votes", kNames);
}

std::string row_text(const JudgementFile& file, std::size_t row) {
    const auto& r = file.rows.at(row);
    const auto& n = file.names;
    return fmt::format("{} {} | {} {}: {} {} {}", n.at(r.left_1), n.at(r.left_2), n.at(r.right_1),
                       n.at(r.right_2), r.votes_left, r.votes_equal, r.votes_right);
}

/// The text is refused, and the message has all these words and the name of the file.
void expect_refused(const std::string& text, const std::vector<std::string>& words) {
    try {
        parse(text);
        ADD_FAILURE() << "taken: " << text;
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), ::testing::StartsWith("votes"));
        for (const auto& word : words) {
            EXPECT_THAT(error.what(), HasSubstr(word)) << text;
        }
    }
}

const std::string kReference = "reference,a,b,votes_a,votes_b\n";
const std::string kConfiguration =
    "left_1,left_2,right_1,right_2,votes_left,votes_equal,votes_right\n";

TEST(JudgementCsv, WithAReference) {
    const auto file = parse("\xef\xbb\xbf" + kReference + "gold,silk,\"st\"\"eel\",3,0\r\n\n" +
                            "silk,wood,gold,0,1000000000");
    EXPECT_EQ(file.format, "reference CSV");
    EXPECT_THAT(file.names, ElementsAre("gold", "silk", "st\"eel", "wood"));
    ASSERT_EQ(file.rows.size(), 2);
    EXPECT_EQ(row_text(file, 0), "gold silk | gold st\"eel: 3 0 0");
    EXPECT_EQ(row_text(file, 1), "silk wood | silk gold: 0 0 1000000000");
}

TEST(Judgements, AByteOrderMarkBelongsToNoFormat) {
    const std::vector<std::string> names = {"a", "b", "c"};
    for (const std::string text : {R"({"answers": [[0, 1, 2]], "agreement": [[3, 1]]})",
                                   "reference,a,b,votes_a,votes_b\na,b,c,3,1\n"}) {
        const auto plain = parse_judgements(text, "j", names);
        const auto marked = parse_judgements("\xef\xbb\xbf" + text, "j", names);
        EXPECT_EQ(marked.format, plain.format);
        EXPECT_EQ(row_text(marked, 0), row_text(plain, 0));
    }
}

TEST(JudgementCsv, WithConfigurations) {
    const auto file = parse(kConfiguration + "a,b,c,d,1,15,484\nb,a,a,c,0,0,1\n");
    EXPECT_EQ(file.format, "configuration CSV");
    ASSERT_EQ(file.rows.size(), 2);
    EXPECT_EQ(row_text(file, 0), "a b | c d: 1 15 484");
    EXPECT_EQ(row_text(file, 1), "b a | a c: 0 0 1");
}

TEST(JudgementCsv, AsASpreadsheetOrADataFrameWritesIt) {
    const auto file = parse("reference;a;b;votes_a;votes_b;\ngold;silk;wood;3,0;0\n;;;;\n");
    ASSERT_EQ(file.rows.size(), 1);
    EXPECT_EQ(row_text(file, 0), "gold silk | gold wood: 3 0 0");
    EXPECT_EQ(row_text(parse("," + kReference + "0,gold,silk,wood,3.0,1.0\n"), 0),
              "gold silk | gold wood: 3 0 1");
    expect_refused(kReference + "gold,silk,wood,1.000,2\n", {"votes_a: found \"1.000\""});
}

TEST(JudgementCsv, BadFilesAreExplained) {
    expect_refused("\n", {"line 1", "header"});
    expect_refused("a,b\n1,2\n", {"line 1", "a,b", "reference,a,b,votes_a,votes_b", "votes_equal"});
    expect_refused(kReference, {"line 1", "no row", "expected a judgement"});
    expect_refused(kReference + "gold,silk,wood,1,2\ngold,silk,wood,1\n",
                   {"line 3", "4 fields", "expected 5"});
    expect_refused(kReference + "gold,silk,wood,1,2,3\n", {"line 2", "6 fields"});
    for (const auto* votes : {"-1", "", "many", "nan", "inf", "1.5", "1e3", " 1", "1 ", "+1", "0x1",
                              "1000000001", "99999999999999999999999"}) {
        expect_refused(fmt::format("{}gold,silk,wood,2,{}\n", kReference, votes),
                       {"line 2", "votes_b", fmt::format("\"{}\"", votes), "whole number"});
    }
    expect_refused(kReference + "gold,gold,wood,1,2\n", {"line 2", "gold", "reference and a"});
    expect_refused(kReference + "gold,wood,gold,1,2\n", {"line 2", "gold", "reference and b"});
    expect_refused(kReference + "gold,silk,silk,1,2\n", {"line 2", "silk", "a and b"});
    expect_refused(kReference + "gold,,silk,1,2\n", {"line 2", "a:", "without a name"});
    expect_refused(kConfiguration + "a,a,b,c,1,0,0\n", {"line 2", "left_1 and left_2"});
    expect_refused(kConfiguration + "a,b,c,c,1,0,0\n", {"line 2", "right_1 and right_2"});
    expect_refused(kConfiguration + "a,b,b,a,1,0,0\n", {"line 2", "both sides"});
    expect_refused(kReference + "gold,\"silk,wood,1,2\n", {"line 2", "quote"});
}

TEST(Lagunas, ReadsBothTablesInAnyOrderAndSkipsTheRest) {
    const auto file = parse(R"( {"x": [[1, "t", null, {"answers": [1.5]}]], "agreement": [[3,1],
        [0, 2]], "y": true, "answers": [[0,1,2], [3,2,0]], "z": {"answers": 1}} )");
    EXPECT_EQ(file.format, "Lagunas 2019 JSON");
    ASSERT_EQ(file.rows.size(), 2);
    EXPECT_EQ(row_text(file, 0), "gold silk | gold steel: 3 0 1");
    EXPECT_EQ(row_text(file, 1), "wood steel | wood gold: 0 0 2");
}

TEST(Lagunas, BadFilesAreExplained) {
    const auto with = [](const std::string& answers, const std::string& agreement) {
        return fmt::format("{{\"answers\": {}, \"agreement\": {}}}", answers, agreement);
    };
    expect_refused("{", {"no JSON", "line 1"});
    expect_refused("{\"answers\": [[0,1,2]],\n\"agreement\": [[1,2]]} x", {"no JSON", "line 2"});
    expect_refused("{}", {"no \"answers\""});
    expect_refused("{\"answers\": []}", {"no \"agreement\""});
    expect_refused(with("[]", "[]"), {"no answers"});
    expect_refused(with("[[0,1,2]]", "[]"), {"1 rows of answers", "0 of agreement"});
    expect_refused(with("[[0,1,2],[0,1,4]]", "[]"), {"answers[1]", "found 4", "0 to 3"});
    expect_refused(with("[[0,1,-2]]", "[]"), {"answers[0]", "found -2"});
    expect_refused(with("[[0,1,1.5]]", "[]"), {"answers[0]", "1.5"});
    expect_refused(with("[[0,1,\"gold\"]]", "[]"), {"answers[0]", "\"gold\""});
    expect_refused(with("[[0,1,[2]]]", "[]"), {"answers[0]", "an array"});
    expect_refused(with("[[0,1,{}]]", "[]"), {"answers[0]", "an object"});
    expect_refused(with("[[0,1]]", "[]"), {"answers[0]", "a row of 2", "rows of 3"});
    expect_refused(with("[[0,1,2,3]]", "[]"), {"answers[0]", "a longer row"});
    expect_refused(with("[0,1,2]", "[]"), {"answers[0]", "found 0"});
    expect_refused(with("3", "[]"), {"answers[0]", "found 3"});
    expect_refused(with("null", "[]"), {"answers[0]", "null"});
    expect_refused(with("{}", "[]"), {"answers[0]", "an object"});
    expect_refused(with("[[0,1,2]]", "[[1,-1]]"), {"agreement[0]", "found -1"});
    expect_refused(with("[[0,1,2]]", "[[1,1000000001]]"), {"agreement[0]", "1000000001"});
    expect_refused(with("[[0,1,2]]", "[[1,1e999]]"), {"no JSON", "1e999"});
    expect_refused(with("[[0,1,1]]", "[[1,1]]"), {"answers[0]", "[0, 1, 1]", "three materials"});
    expect_refused(R"({"answers": [], "answers": []})", {"\"answers\" twice"});
}

TEST(Lagunas, DepthNeedsNoStack) {
    constexpr std::size_t deep = 1'000'000;
    expect_refused("{\"x\": " + std::string(deep, '['), {"no JSON"});
    EXPECT_EQ(parse("{\"x\": " + std::string(deep, '[') + std::string(deep, ']') +
                    R"(, "answers": [[0,1,2]], "agreement": [[1,0]]})")
                  .rows.size(),
              1);
}

TEST(Lagunas, CountsMaterialsByTheNamesOfTheirFiles) {
    EXPECT_THAT(lagunas_order({"chrome", "chrome-steel", "cherry-235", "black"}),
                ElementsAre("black", "cherry-235", "chrome-steel", "chrome"));
}

}  // namespace
}  // namespace merl::scan
