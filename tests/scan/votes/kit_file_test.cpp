#include "scan/votes/kit_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

/// A kit with everything that a file can have.
Kit whole_kit() {
    Kit kit = parse_kit(testing::small_kit, "kit.json");
    kit.version = "1.2.3";
    kit.database = {.name = "db",
                    .kind = "MERL directory",
                    .content_hash = "c",
                    .checked = true,
                    .material_hashes = {{"b", "2"}, {"a", "1"}, {"d", "4"}, {"c", "3"}},
                    .skipped = {{"bad", "bad.binary: has 1 bytes"}},
                    .databases = {{"one", "~/one", "MERL directory", "e"},
                                  {"two", "~/two", "RGL directory", std::nullopt}}};
    kit.warnings = {"one", "two"};
    kit.plan = {.seed = (1ULL << 53U) - 1, .repeats = 12.5, .sentinels = 1, .random = 0};
    kit.sentinel_pairs = 21;
    kit.lots = {.sides = false, .pairs = true, .order = false};
    kit.view = {.size = 16,
                .field_of_view = 60,
                .lights = {{1, 1, 1}, {-1, 0.5, 0.1}},
                .exposure = -0.5,
                .background = 0.25,
                .encoding = "srgb"};
    kit.practice = {"a", "a", "a", "c"};
    return kit;
}

TEST(KitFile, IsReadAsItWasWritten) {
    const Kit kit = whole_kit();
    const Kit read = parse_kit(kit_text(kit), "kit.json");
    EXPECT_EQ(read.file, "kit.json");
    EXPECT_EQ(read.version, kit.version);
    EXPECT_EQ(read.kit_hash, kit.kit_hash);
    EXPECT_EQ(read.selection_hash, kit.selection_hash);
    EXPECT_EQ(read.first_metric, "x");
    EXPECT_EQ(read.second_metric, "y");
    EXPECT_EQ(read.database, kit.database);
    EXPECT_EQ(read.warnings, kit.warnings);
    EXPECT_EQ(read.plan, kit.plan);
    EXPECT_EQ(read.sentinel_pairs, 21);
    EXPECT_EQ(read.lots, kit.lots);
    EXPECT_EQ(read.view, kit.view);
    EXPECT_EQ(read.practice, kit.practice);
    EXPECT_EQ(read.trials, kit.trials);
    EXPECT_EQ(kit_text(read), kit_text(kit));
}

constexpr std::string_view reference_kit =
    R"({"kit_hash": "k", "selection_hash": "h", "metrics": ["x", "y"], "reference": "o", "trials": [
    {"configuration": 1, "kind": "selection", "left": ["o/m", "a/m"], "right": ["o/m", "b/m"]},
    {"configuration": 2, "kind": "sentinel", "left": ["o/m", "o/m"], "right": ["o/m", "b/m"],
     "expected": 1}]})";

TEST(KitFile, OfAReferenceIsReadAsItWasWritten) {
    const Kit kit = parse_kit(reference_kit, "kit.json");
    EXPECT_EQ(kit.reference, "o");
    EXPECT_EQ(kit_json(kit)["reference"], "o");
    EXPECT_EQ(parse_kit(kit_text(kit), "kit.json").reference, "o");
    EXPECT_FALSE(kit_json(whole_kit()).contains("reference"));
    const auto refused = [](const std::string& from, const std::string& to) -> std::string {
        std::string text(reference_kit);
        text.replace(text.find(from), from.size(), to);
        try {
            parse_kit(text, "kit.json");
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    const auto* const expected = R"(expected an original, "o/…", first on both sides)";
    EXPECT_THAT(refused(R"(["o/m", "a/m"])", R"(["a/m", "o/m"])"), ::testing::HasSubstr(expected));
    EXPECT_THAT(refused(R"(["o/m", "a/m"])", R"(["o/n", "a/n"])"), ::testing::HasSubstr(expected));
    EXPECT_THAT(refused(R"("reference": "o")", R"("reference": "p")"),
                ::testing::HasSubstr("\"p/…\""));
    EXPECT_THAT(refused(R"("reference": "o")", R"("reference": 1)"),
                ::testing::HasSubstr("\"reference\": expected a text"));
    EXPECT_THAT(
        refused(R"("reference": "o", )", ""),
        ::testing::HasSubstr("trials[1]: found o/m and o/m against o/m and b/m; expected two "
                             "materials on each side"));
}

TEST(KitFile, WhatMayBeMissingIsAsByDefault) {
    const Kit kit = parse_kit(testing::small_kit, "kit.json");
    EXPECT_EQ(kit.version, "");
    EXPECT_EQ(kit.database, KitDatabase());
    EXPECT_EQ(kit.lots, KitLots());
    EXPECT_EQ(kit.view, KitView());
    EXPECT_EQ(kit.trials.at(3).expected, 3);
    EXPECT_EQ(kit.trials.at(3).agreement, 0.5);
    EXPECT_FALSE(kit.trials.at(0).agreement);
}

TEST(KitFile, MaterialsAreInTheOrderOfTheTrials) {
    const Kit kit = whole_kit();
    EXPECT_THAT(shown_materials(kit), ::testing::ElementsAre("b", "a", "c", "d"));
    EXPECT_EQ(kit_json(kit)["database"]["material_hashes"].dump(),
              R"({"b":"2","a":"1","c":"3","d":"4"})");
}

TEST(KitFile, TheHashIsOfEverythingButItself) {
    Kit kit = whole_kit();
    const std::vector<std::vector<std::string>> images = {{"1", "2"}, {"3"}};
    const auto hash = kit_hash_of(kit, images);
    kit.kit_hash = hash;
    EXPECT_EQ(kit_hash_of(kit, images), hash);
    EXPECT_NE(kit_hash_of(kit, std::vector<std::vector<std::string>>{{"1", "2"}, {"4"}}), hash);
    kit.view.background = 0.5;
    EXPECT_NE(kit_hash_of(kit, images), hash);
}

TEST(KitFile, KeepsNothingButWhatItNeeds) {
    const auto refused = [](const std::string& text) -> std::string {
        try {
            parse_kit(text, "kit.json");
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    const std::string kit(testing::small_kit);
    const std::string begin = kit.substr(0, kit.find("\"more\""));
    const std::string end = kit.substr(kit.find("\"trials\""));
    const std::string deep = std::string(99, '[') + std::string(99, ']');
    EXPECT_EQ(refused(begin + "\"more\": " + deep + ", " + end), "");
    EXPECT_THAT(refused(begin + "\"more\": [[" + deep + "]], " + end),
                ::testing::HasSubstr("nested more than 100 deep"));
    EXPECT_THAT(refused(begin + "\"trials\": []," + end), ::testing::HasSubstr("twice"));
    std::string many = "0";
    for (int i = 0; i < 300'000; ++i) {
        many += ",0";
    }
    EXPECT_EQ(refused(begin + "\"more\": [" + many + "], " + end), "");
    const std::string trial = R"({"configuration": 1, "kind": "selection", "left": ["b", "a"], )";
    EXPECT_THAT(refused(begin + R"("trials": [)" + trial + R"("right": [)" + many + "]}]}"),
                ::testing::HasSubstr("trials[0]: found an array that is too long"));
    EXPECT_EQ(refused(begin + R"("trials": [)" + trial + R"("more": [)" + many +
                      R"(], "right": ["c", "d"]}]})"),
              "");
    for (const std::string other : {"3", "[]", "null", "\"x\""}) {
        EXPECT_THAT(refused(begin + R"("trials": [)" + other + "]}"),
                    ::testing::HasSubstr("trials[0]: expected an object"));
        EXPECT_THAT(refused(other), ::testing::HasSubstr("kit.json: expected an object"));
    }
    EXPECT_EQ(parse_kit("\xef\xbb\xbf" + kit, "kit.json").trials.size(), 4U);
}

TEST(KitFile, BadFilesAreExplained) {
    const auto refused = [](const std::string& from, const std::string& to,
                            const std::string& word) {
        std::string text(testing::small_kit);
        if (!from.empty()) {
            text.replace(text.find(from), from.size(), to);
        }
        try {
            parse_kit(from.empty() ? to : text, "kit.json");
            ADD_FAILURE() << word;
        } catch (const InputError& error) {
            EXPECT_THAT(error.what(), ::testing::AllOf(::testing::StartsWith("kit.json"),
                                                       ::testing::HasSubstr(word)));
        }
    };
    refused("", "{", "no JSON");
    refused("", "[]", "object");
    refused("", "{}", "metrics");
    refused("\"k\"", "1", "kit_hash");
    refused("[\"x\", \"y\"]", "[\"x\"]", "metrics");
    refused("\"configuration\": 1", "\"configuration\": -1", "trials[0]");
    refused("\"kind\": \"repeat\"", "\"kind\": \"again\"", "trials[2]");
    refused("\"expected\": 3", "\"expected\": 2", "trials[3]");
    refused("\"expected\": 3,", "", "expected");
    refused("\"configuration\": 2", "\"configuration\": 1", "second time");
    refused("[\"b\", \"a\"]", "[\"b\", \"b\"]", "twice");
    refused("[\"b\", \"a\"]", "[\"b\", 1]", "left");
    // What may be missing is of its kind where it is there.
    refused("\"seed\": 1", "\"seed\": -1", "\"seed\": expected a whole number");
    const auto refused_key = [&](const std::string& key, const std::string& word) {
        refused("\"more\": [1]", key, word);
    };
    refused_key(R"("warnings": "none")", "\"warnings\": expected texts");
    refused_key(R"("warnings": [1])", "\"warnings\": expected texts");
    refused_key(R"("program": "merl-scan")", "program: expected an object");
    refused_key(R"("practice": {"left": ["a", "a"]})", "practice: \"right\" is missing");
    refused_key(R"("database": {"name": "db"})", "database: \"kind\" is missing");
    refused_key(R"("database": {"kind": "k", "content_hash": 1})", "\"content_hash\"");
    refused_key(R"("database": {"kind": "k", "checked": 1})", "\"checked\": expected true");
    refused_key(R"("database": {"kind": "k", "databases": {}})",
                "\"databases\": expected an array");
    refused_key(R"("database": {"kind": "k", "databases": [1]})", "databases: expected an object");
    refused_key(R"("database": {"kind": "k", "databases": [{"label": 1}]})", "\"label\": expected");
    refused_key(R"("database": {"kind": "k", "material_hashes": {"a": 1}})",
                "material_hashes: \"a\": expected a text");
    refused_key(R"("options": {"sentinels": 4294967296})", "from 0 to 4294967295");
    refused_key(R"("options": {"repeats_percent": "10"})", "expected a number");
    refused_key(R"("options": {"randomise": {"sides": "yes"}})", "randomise: \"sides\"");
    refused_key(R"("options": {"lights": [[1, 2]]})", "three numbers");
    refused_key(R"("options": {"lights": [[1, 2, "3"]]})", "three numbers");
}

}  // namespace
}  // namespace merl::scan
