#include "scan/votes/votes.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/votes/judge_name.h"
#include "scan/votes/kit_file.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

SelectionFile selection() {
    return parse_selection(
        "rank,left_1,left_2,right_1,right_2,x_left,x_right,y_left,y_right,agreement\n"
        "1,a,b,c,d,1,2,4,1,0.125\n"
        "2,a,c,b,d,1,2,3,2,0.25\n",
        "s.csv");
}

VoteFile votes_of(const std::string& judge, const std::vector<std::string>& rows,
                  const std::string& kit = "k") {
    std::string text =
        "judge,trial,configuration,kind,left_1,left_2,right_1,right_2,swapped,vote,response_ms,"
        "seed,kit_hash\n";
    for (std::size_t i = 0; i < rows.size(); ++i) {
        text += fmt::format("{},{},{},,1,{}\n", judge, i + 1, rows[i], kit);
    }
    return parse_votes(text, judge + ".csv");
}

const std::vector<std::string> kRows = {"2,selection,b,d,c,a,1,1", "1,selection,a,b,c,d,0,2",
                                        "2,repeat,a,c,b,d,0,3", "3,sentinel,c,b,d,a,1,1"};

void expect_refused(const std::vector<VoteFile>& files, const Kit* kit,
                    const std::vector<std::string>& words) {
    try {
        gather_votes(selection(), "h", kit, files);
        ADD_FAILURE() << "taken; expected " << words[0];
    } catch (const InputError& error) {
        for (const auto& word : words) {
            EXPECT_THAT(error.what(), ::testing::HasSubstr(word));
        }
    }
}

TEST(GatherVotes, UndoesTheSides) {
    const auto kit = parse_kit(testing::small_kit, "kit.json");
    for (const auto* with : {&kit, static_cast<const Kit*>(nullptr)}) {
        const auto votes = gather_votes(selection(), "h", with, std::vector{votes_of("j", kRows)});
        EXPECT_EQ(votes.trials, 4);
        ASSERT_EQ(votes.configurations.size(), 3);
        EXPECT_EQ(votes.configurations[0].agreement, 0.125);
        EXPECT_EQ(votes.configurations[2].kind, TrialKind::sentinel);
        EXPECT_EQ(votes.configurations[2].expected, with != nullptr ? 3 : 0);
        const auto& ballots = votes.judges.at(0).ballots;
        ASSERT_EQ(ballots.size(), 4);
        EXPECT_EQ(ballots[0].configuration, 1);
        EXPECT_EQ(ballots[0].shown, 1);
        EXPECT_EQ(ballots[0].side(), 3);  // shown left: the right pair of the selection
        EXPECT_EQ(ballots[1].side(), 2);
        EXPECT_EQ(ballots[2].side(), 3);
        EXPECT_TRUE(ballots[2].repeat);
        EXPECT_EQ(ballots[3].side(), 3);
    }
}

TEST(GatherVotes, TrialsWithoutARowAreMissing) {
    const auto kit = parse_kit(testing::small_kit, "kit.json");
    const auto one = votes_of("one", {kRows[0]});
    auto votes = gather_votes(selection(), "h", &kit, std::vector{one});
    ASSERT_EQ(votes.judges[0].ballots.size(), 4);
    for (std::size_t i = 1; i < 4; ++i) {
        EXPECT_EQ(votes.judges[0].ballots[i].side(), 0);
    }
    // Without a kit: the selection, and what the other judge has.
    votes = gather_votes(selection(), "h", nullptr, std::vector{one, votes_of("two", kRows)});
    EXPECT_EQ(votes.judges[0].ballots.size(), 4);
    votes = gather_votes(selection(), "h", nullptr, std::vector{one});
    EXPECT_EQ(votes.judges[0].ballots.size(), 2);
}

TEST(GatherVotes, BadVotesAreExplained) {
    const auto kit = parse_kit(testing::small_kit, "kit.json");
    const auto good = votes_of("j", kRows);
    expect_refused({}, nullptr, {"no votes"});
    expect_refused({good, votes_of("i", kRows, "other")}, nullptr, {"i.csv", "other", "j.csv"});
    expect_refused({votes_of("i", kRows, "other")}, &kit, {"i.csv", "other", "kit.json"});
    for (const auto* with : {&kit, static_cast<const Kit*>(nullptr)}) {
        // Edited: the sides, a material, the number.
        expect_refused({votes_of("j", {"1,selection,a,b,c,d,1,1"})}, with,
                       {"j.csv, line 2", "swapped 1", "configuration 1", "a | b against c | d"});
        expect_refused({votes_of("j", {"1,selection,a,b,c,e,0,1"})}, with, {"c | e"});
        expect_refused({votes_of("j", {"2,selection,a,b,c,d,0,1"})}, with, {"configuration 2"});
        expect_refused({votes_of("j", {"4,selection,a,b,c,d,0,1"})}, with, {"found 4"});
        expect_refused({votes_of("j", {"4,repeat,a,b,c,d,0,1"})}, with, {"found 4"});
        expect_refused({votes_of("j", {"1,random,a,b,c,d,0,1"})}, with, {"found 1 as random"});
    }
    expect_refused({votes_of("j", {"1,repeat,a,b,c,d,0,1"})}, &kit,
                   {"repeat of configuration 1", "kit.json does not have"});
    expect_refused({good, votes_of("i", {"3,sentinel,a,b,c,d,0,1"})}, nullptr, {"i.csv, line 2"});
}

std::string other_votes(const VoteFile& file, std::size_t row, std::uint8_t vote) {
    std::vector<VoteFile> files(2, file);
    files[1].file = "again.csv";
    files[1].rows.at(row).vote = vote;
    try {
        const auto votes = gather_votes(selection(), "h", nullptr, files);
        EXPECT_EQ(votes.judges.size(), 1);
        EXPECT_EQ(votes.warnings.size(), 1);
        return votes.judges.at(0).file + ": " + votes.warnings.at(0);
    } catch (const InputError& error) {
        return error.what();
    }
}

TEST(GatherVotes, SavesOfAJudgeCountOnce) {
    const auto whole = votes_of("Anna", kRows);
    EXPECT_EQ(other_votes(whole, 0, 1),
              "Anna.csv: again.csv: has the same votes of \"Anna\" as Anna.csv; they are counted "
              "once");
    EXPECT_EQ(other_votes(whole, 0, 0),
              "Anna.csv: again.csv: is an earlier save of the votes of \"Anna\", all of which "
              "Anna.csv has; only that one is counted");
    EXPECT_EQ(other_votes(whole, 2, 1),
              "again.csv, line 4: is not what Anna.csv, line 4, says of the same trial of "
              "\"Anna\"; expected one judge's votes once: give only the last save, or two judges "
              "two names");
    // The fuller one comes later, is written otherwise, or has more rows.
    for (const auto* name : {"ANNA", " anna "}) {
        auto more = votes_of(name, kRows);
        auto less = whole;
        less.rows.pop_back();
        less.rows[1].vote = 0;
        const auto votes = gather_votes(selection(), "h", nullptr,
                                        std::vector{less, votes_of("bo", kRows), more, less, more});
        ASSERT_EQ(votes.judges.size(), 2);
        EXPECT_EQ(votes.judges[0].name, name);
        EXPECT_EQ(votes.judges[0].ballots[1].shown, 2);
        EXPECT_EQ(votes.judges[1].name, "bo");
        EXPECT_EQ(votes.warnings.size(), 3);
    }
    // Neither has all.
    auto other = whole;
    other.file = "other.csv";
    auto first = whole;
    first.rows[0].vote = 0;
    other.rows[1].vote = 0;
    expect_refused({first, other}, nullptr, {"other.csv", "Anna.csv has not", "lacks some"});
    // The same vote at another time, or what was shown otherwise, is another answer.
    other = whole;
    other.rows[0].response_ms = 5;
    expect_refused({whole, other}, nullptr, {"line 2", "same trial", "two names"});
    other = votes_of("anna", {"1,selection,a,b,c,d,0,2", "2,selection,b,d,c,a,1,1"});
    expect_refused({whole, other}, nullptr, {"anna.csv, line 2", "same trial", "two names"});
}

TEST(GatherVotes, NamesAreTheSameInUpperAndLowerCase) {
    for (const auto& [one, other] :
         std::vector<std::pair<std::string, std::string>>{{"anna", "ANNA"},
                                                          {"\u00e5sa", "\u00c5SA"},
                                                          {"\u03b1\u03c3", "\u0391\u03c2"},
                                                          {"stra\u00dfe", "STRA\u00dfE"},
                                                          {" an  na ", "An Na"},
                                                          {"\xff", "\xff"}}) {
        EXPECT_EQ(judge_identity(one), judge_identity(other)) << one;
    }
    EXPECT_NE(judge_identity("anna"), judge_identity("an na"));
    EXPECT_NE(judge_identity("\xff"), judge_identity("\xfe"));
    EXPECT_NE(judge_identity("\u00e5"), judge_identity("a"));
    EXPECT_NE(judge_identity("\u0130nci"), judge_identity("inci"));
    EXPECT_EQ(judge_identity("\u0130NC\u0130"), judge_identity("\u0130nc\u0130"));
    EXPECT_EQ(judge_identity("\u0131nci"), judge_identity("INCI"));
}

TEST(GatherVotes, AnotherKitIsExplained) {
    const auto changed = [](const std::string& from, const std::string& to) {
        std::string text(testing::small_kit);
        return parse_kit(text.replace(text.find(from), from.size(), to), "kit.json");
    };
    const std::vector<VoteFile> files = {votes_of("j", kRows)};
    auto kit = changed("\"h\"", "\"g\"");
    expect_refused(files, &kit, {"kit.json", "hash g", "expected h", "s.csv"});
    kit = changed("[\"x\", \"y\"]", "[\"y\", \"x\"]");
    expect_refused(files, &kit, {"kit.json", "metrics y and x", "expected x and y"});
    // Names that are no UTF-8 stand escaped in kit.json, and there alone.
    kit = changed("[\"x\", \"y\"]", R"(["x\\xff", "y"])");
    auto raw = selection();
    raw.first_metric = "x\xff";
    EXPECT_NO_THROW(gather_votes(raw, "h", &kit, files));
    expect_refused(files, &kit, {"kit.json", "metrics x\\xff and y", "expected x and y"});
    kit = changed("[\"b\", \"a\"]", "[\"b\", \"e\"]");
    expect_refused(files, &kit, {"configuration 1", "is not that of s.csv"});
    kit = changed("\"configuration\": 1", "\"configuration\": 9");
    expect_refused(files, &kit, {"configuration 9"});
}

TEST(CompareWithScan, OtherMaterialsAreRefused) {
    auto kit = parse_kit(testing::small_kit, "kit.json");
    const ScannedMaterials scanned = {
        .file = "summary.json", .kind = "MERL directory", .hashes = {{"a", "1"}, {"b", "2"}}};
    EXPECT_THAT(compare_with_scan(kit, scanned), ::testing::StartsWith("kit.json: was written"));
    kit.database.kind = scanned.kind;
    kit.database.material_hashes = {{"b", "2"}};
    EXPECT_EQ(compare_with_scan(kit, scanned), "");
    EXPECT_THAT(compare_with_scan(kit, {.file = "old.json", .kind = scanned.kind, .hashes = {}}),
                ::testing::StartsWith("old.json: was written"));
    const auto refused = [&](const std::string& word) {
        try {
            compare_with_scan(kit, scanned);
            ADD_FAILURE() << word;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), ::testing::AllOf(::testing::StartsWith("kit.json: "),
                                                       ::testing::HasSubstr(word),
                                                       ::testing::HasSubstr("summary.json")));
        }
    };
    kit.database.material_hashes["a"] = "3";
    refused("sphere of \"a\"");
    kit.database.material_hashes = {{"c", "1"}};
    refused("sphere of \"c\"");
    kit.database.kind = "built-in stand-in";
    refused("are of a built-in stand-in, and the scan was of a MERL directory");
}

}  // namespace
}  // namespace merl::scan
