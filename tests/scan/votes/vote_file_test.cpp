#include "scan/votes/vote_file.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/io/input.h"

namespace merl::scan {
namespace {

using ::testing::HasSubstr;

const std::string kHeader =
    "judge,trial,configuration,kind,left_1,left_2,right_1,right_2,swapped,vote,response_ms,seed,"
    "kit_hash\n";

void expect_refused(const std::string& text, const std::vector<std::string>& words) {
    try {
        parse_votes(text, "ann.csv");
        ADD_FAILURE() << "taken: " << text;
    } catch (const InputError& error) {
        EXPECT_THAT(error.what(), ::testing::StartsWith("ann.csv, line "));
        for (const auto& word : words) {
            EXPECT_THAT(error.what(), HasSubstr(word)) << text;
        }
    }
}

TEST(VoteFile, IsRead) {
    const auto file = parse_votes("\xef\xbb\xbf" + kHeader +
                                      "\"Ann, =1\",1,7,selection,a,b,c,d,0,1,1234.5,9,k1\r\n"
                                      "\"Ann, =1\",3,7,repeat,d,c,\"b\"\"\",a,1,,,9,k1\r\n",
                                  "ann.csv");
    EXPECT_EQ(file.judge, "Ann, =1");
    EXPECT_EQ(file.kit_hash, "k1");
    ASSERT_EQ(file.rows.size(), 2);
    const auto& first = file.rows[0];
    EXPECT_EQ(first.trial, 1);
    EXPECT_EQ(first.configuration, 7);
    EXPECT_EQ(first.kind, TrialKind::selection);
    EXPECT_EQ(first.shown, (FourMaterials{"a", "b", "c", "d"}));
    EXPECT_FALSE(first.swapped);
    EXPECT_EQ(first.vote, 1);
    EXPECT_EQ(first.response_ms, 1234.5);
    const auto& second = file.rows[1];
    EXPECT_EQ(second.line, 3);
    EXPECT_EQ(second.kind, TrialKind::repeat);
    EXPECT_EQ(second.shown[2], "b\"");
    EXPECT_TRUE(second.swapped);
    EXPECT_EQ(second.vote, 0);
    EXPECT_FALSE(second.response_ms.has_value());
}

TEST(VoteFile, ASentinelMayShowAnOriginalWithItself) {
    EXPECT_EQ(parse_votes(kHeader + "j,1,1,sentinel,o,o,o,b,0,1,,s,k\n"
                                    "j,2,2,sentinel,o,b,o,o,1,3,,s,k\n",
                          "ann.csv")
                  .rows.size(),
              2);
    expect_refused(kHeader + "j,1,1,random,o,o,o,b,0,1,,s,k\n", {"\"o\" twice"});
    expect_refused(kHeader + "j,1,1,sentinel,o,o,b,c,0,1,,s,k\n", {"\"o\" twice"});
    expect_refused(kHeader + "j,1,1,sentinel,o,o,o,o,0,1,,s,k\n", {"\"o\" twice"});
    expect_refused(kHeader + "j,1,1,sentinel,o,o,o,,0,1,,s,k\n", {"without a name"});
}

TEST(VoteFile, AsASpreadsheetWritesIt) {
    std::string header = kHeader.substr(0, kHeader.size() - 1);
    std::ranges::replace(header, ',', ';');
    const auto file =
        parse_votes(header + ";\r\n" + "ann;1,0;7,0;selection;a;b;c;d;0,0;3,0;1234,5;9;k1;\r\n" +
                        ";;;;;;;;;;;;;\r\n" + "ann;2;8;random;a;b;c;d;1;1;20;9;k1\r\n",
                    "ann.csv");
    ASSERT_EQ(file.rows.size(), 2);
    EXPECT_EQ(file.rows[0].configuration, 7);
    EXPECT_EQ(file.rows[0].vote, 3);
    EXPECT_EQ(file.rows[0].response_ms, 1234.5);
    EXPECT_TRUE(file.rows[1].swapped);
}

TEST(VoteFile, BadFilesAreExplained) {
    const auto row = [](const std::string& start, const std::string& end) {
        return fmt::format("{}{},a,b,c,d,{}\n", kHeader, start, end);
    };
    expect_refused("a,b\n", {"line 1", "\"a,b\"", "judge,trial"});
    expect_refused("\n", {"header"});
    expect_refused(fmt::format("{},x\n", kHeader.substr(0, kHeader.size() - 1)),
                   {"found 14 columns, \"judge,", "kit_hash,x\"", "expected 13, \"judge,"});
    expect_refused(kHeader, {"no row", "expected a trial"});
    expect_refused(kHeader + "j,1\n", {"line 2", "2 fields", "expected 13"});
    expect_refused(row(",1,1,selection", "0,1,,s,k"), {"judge", "no name"});
    for (const auto* vote : {"0", "4", "-1", "12", "left", " 1"}) {
        expect_refused(row("j,1,1,selection", fmt::format("0,{},,s,k", vote)),
                       {"line 2", fmt::format("vote: found \"{}\"", vote), "1, 2, 3"});
    }
    for (const auto* number : {"0", "", "-1", "1.5", "1e3", "1000000001", "99999999999999999999"}) {
        expect_refused(row(fmt::format("j,{},1,selection", number), "0,1,,s,k"),
                       {fmt::format("trial: found \"{}\"", number)});
        expect_refused(row(fmt::format("j,1,{},selection", number), "0,1,,s,k"),
                       {fmt::format("configuration: found \"{}\"", number)});
    }
    expect_refused(row("j,1,1,practice", "0,1,,s,k"), {"kind: found \"practice\"", "sentinel"});
    expect_refused(row("j,1,1,selection", "yes,1,,s,k"), {"swapped: found \"yes\"", "0 or 1"});
    for (const auto* time : {"-1", "nan", "inf", "1s", "1e999"}) {
        expect_refused(row("j,1,1,selection", fmt::format("0,1,{},s,k", time)),
                       {fmt::format("response_ms: found \"{}\"", time)});
    }
    expect_refused(kHeader + "j,1,1,selection,a,a,c,d,0,1,,s,k\n", {"\"a\" twice"});
    expect_refused(kHeader + "j,1,1,selection,a,b,b,a,0,1,,s,k\n", {"both sides"});
    expect_refused(kHeader + "j,1,1,selection,a,,b,a,0,1,,s,k\n", {"without a name"});
    const std::string good = row("j,1,1,selection", "0,1,,s,k");
    expect_refused(good + "i,2,2,selection,a,b,c,d,0,1,,s,k\n", {"line 3", "found \"i\"", "\"j\""});
    expect_refused(good + "j,2,2,selection,a,b,c,d,0,1,,t,k\n", {"seed: found \"t\""});
    expect_refused(good + "j,2,2,selection,a,b,c,d,0,1,,s,l\n", {"kit_hash: found \"l\""});
    expect_refused(good + "j,1,2,selection,a,b,c,d,0,1,,s,k\n", {"line 3", "trial 1 a second"});
    expect_refused(good + "j,2,1,selection,a,b,c,d,0,1,,s,k\n", {"configuration 1 a second"});
}

}  // namespace
}  // namespace merl::scan
