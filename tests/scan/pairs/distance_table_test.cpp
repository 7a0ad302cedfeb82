#include "scan/pairs/distance_table.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>

#include "engine/base/error.h"
#include "scan/io/input.h"
#include "scan/pairs/listed_distances.h"

namespace merl::scan {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr std::string_view kThree =
    "material_1,material_2,one,two\n"
    "c,a,0.5,2\n"
    "a,b,1,3e-2\n"
    "b,c,0,1e300\n";

DistanceTable parse(std::string_view text, const std::vector<std::string>& columns = {}) {
    return parse_distance_table(text, "t.csv", columns);
}

std::string complaint(std::string_view text, const std::vector<std::string>& columns = {}) {
    try {
        parse(text, columns);
    } catch (const InputError& error) {
        return error.what();
    }
    return "none";
}

std::string written(const DistanceTable& table) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    write_distance_table(::fileno(file.get()), table);
    std::string text(static_cast<std::size_t>(::lseek(::fileno(file.get()), 0, SEEK_END)), '\0');
    EXPECT_EQ(::pread(::fileno(file.get()), text.data(), text.size(), 0),
              static_cast<ssize_t>(text.size()));
    return text;
}

TEST(DistanceTable, AnyOrderAndOrientation) {
    const auto table = parse(kThree);
    EXPECT_THAT(table.names, ElementsAre("a", "b", "c"));
    ASSERT_EQ(table.metrics.size(), 2U);
    EXPECT_EQ(table.metrics[0].metric, "one");
    EXPECT_THAT(table.metrics[0].values, ElementsAre(1, 0.5, 0));
    EXPECT_THAT(table.metrics[1].values, ElementsAre(0.03, 2, 1e300));
    const auto scanned = table.view(1, 0);
    EXPECT_EQ(scanned.first_metric, "two");
    EXPECT_THAT(scanned.second, ElementsAre(1, 0.5, 0));
    EXPECT_NO_THROW(scanned.validate());
}

TEST(DistanceTable, NamedColumnsOnlyAndInTheirOrder) {
    constexpr std::string_view kText = "material_1,material_2,note,y,x\nb,a,hello,1,2\n";
    const auto table = parse(kText, {"x", "y"});
    EXPECT_EQ(table.metrics[0].metric, "x");
    EXPECT_THAT(table.metrics[0].values, ElementsAre(2));
    EXPECT_THAT(table.metrics[1].values, ElementsAre(1));
    EXPECT_THAT(complaint(kText),
                AllOf(HasSubstr("line 2"), HasSubstr("note"), HasSubstr("hello")));
    EXPECT_THAT(complaint(kText, {"z"}), AllOf(HasSubstr("\"z\""), HasSubstr("note, y, x")));
    EXPECT_THAT(complaint(kText, {"material_1"}), HasSubstr("no metric"));
}

TEST(DistanceTable, ReadsWhatAScanWrites) {
    const auto table = parse(
        "material_1,material_2,p,q,p_bound,q_bound,p_precision,q_precision\n"
        "a,b,1,2,1e-9,0,float32,float64\n");
    ASSERT_EQ(table.metrics.size(), 2U);
    EXPECT_EQ(table.metrics[1].metric, "q");
    // As `compare` once wrote it.
    EXPECT_THAT(parse("material_a,material_b,m\nb,a,2\n").metrics[0].values, ElementsAre(2));
    // Without the column that it describes it is a metric like others.
    EXPECT_EQ(parse("material_1,material_2,z_bound\na,b,1\n").metrics[0].metric, "z_bound");
}

TEST(DistanceTable, WritesPairOrderAndReadsItBack) {
    EXPECT_EQ(written(parse(kThree)),
              "material_1,material_2,one,two\na,b,1,0.03\na,c,0.5,2\nb,c,0,1e+300\n");
    DistanceTable table = {{"\"a\",\n", "b", "\xff"}, {{"m,1", {0.1, 1.0 / 3, 5e-324}, {}}}};
    const auto again = parse(written(table));
    EXPECT_EQ(again.names, table.names);
    EXPECT_EQ(again.metrics[0].metric, "m,1");
    EXPECT_EQ(again.metrics[0].values, table.metrics[0].values);
}

TEST(DistanceTable, MinusZeroIsZero) {
    const auto table = parse("material_1,material_2,m\na,b,-0.0\n");
    EXPECT_FALSE(std::signbit(table.metrics[0].values[0]));
}

TEST(DistanceTable, SortsNamesBytewise) {
    const auto table = parse("material_1,material_2,m\nb,Z,1\n\xc3\xa4,b,2\nZ,\xc3\xa4,3\n");
    EXPECT_THAT(table.names, ElementsAre("Z", "b", "\xc3\xa4"));
    EXPECT_THAT(table.metrics[0].values, ElementsAre(1, 3, 2));
}

TEST(DistanceTable, MissingPairs) {
    EXPECT_THAT(complaint("material_1,material_2,m\na,b,1\nb,c,1\n"),
                AllOf(HasSubstr("2 pairs of 3 materials"), HasSubstr("\"a\" and \"c\"")));
    EXPECT_THAT(complaint("material_1,material_2,m\na,b,1\nb,c,1\na,d,1\nb,d,1\na,c,1\n"),
                HasSubstr("\"c\" and \"d\""));
    // Few rows, billions of pairs: refused before there is memory for them.
    std::string text = "material_1,material_2,m\n";
    for (std::uint32_t i = 0; i < max_materials; i += 2) {
        text += std::to_string(i) + ',' + std::to_string(i + 1) + ",1\n";
    }
    EXPECT_THAT(complaint(text), HasSubstr("2147450880"));
    EXPECT_THAT(complaint(text + "x,y,1\n"), AllOf(HasSubstr("line 32770"), HasSubstr("65536")));
}

TEST(DistanceTable, PairsThatDoNotBelong) {
    EXPECT_THAT(complaint("material_1,material_2,m\na,b,1\na,c,1\nb,c,1\nb,a,1.5\n"),
                AllOf(HasSubstr("line 5"), HasSubstr("found 1.5 for \"a\" and \"b\""),
                      HasSubstr("1 in line 2")));
    EXPECT_THAT(
        complaint("material_1,material_2,m\na,a,0.5\n"),
        AllOf(HasSubstr("line 2"), HasSubstr("m: found \"a\" with itself"), HasSubstr("0.5")));
    EXPECT_THAT(complaint("material_1,material_2,m\na,a,0\n"), HasSubstr("no pair"));
    EXPECT_THAT(complaint("material_1,material_2,m\n,a,0\n"), HasSubstr("without a name"));
}

TEST(DistanceTable, PairsThatAreThereAgain) {
    const auto table = parse(
        "material_1,material_2,m,n\na,b,1,-0.0\na,a,0,0\nb,a,1.0,0\na,c,2,3\nb,c,4,5\na,b,1,0\n"
        "c,a,2,3\n");
    EXPECT_THAT(table.names, ElementsAre("a", "b", "c"));
    EXPECT_THAT(table.metrics[0].values, ElementsAre(1, 2, 4));
    EXPECT_THAT(table.metrics[1].values, ElementsAre(0, 3, 5));
    // Only what is asked for has to be the same.
    EXPECT_THAT(parse("material_1,material_2,m,n\na,b,1,2\nb,a,1,3\n", {"m"}).metrics[0].values,
                ElementsAre(1));
}

TEST(DistanceTable, SemicolonsAndDecimalCommas) {
    EXPECT_THAT(parse("material_1;material_2;m;n\nb;a;0,5;1\n").metrics[0].values,
                ElementsAre(0.5));
    EXPECT_THAT(complaint("material_1,material_2,m\na,b,1,5\n"),
                AllOf(HasSubstr("found 4 fields; expected 3"), HasSubstr("decimal comma")));
    EXPECT_THAT(complaint("material_1;material_2;m\na;b;0,5\na;c;1.234\n"),
                AllOf(HasSubstr("line 3"), HasSubstr("one decimal mark")));
    EXPECT_THAT(complaint("material_1,material_2,m\na,b,\"1,5\"\n"), HasSubstr("semicolons"));
}

TEST(DistanceTable, RowNumbersAndEmptyColumns) {
    const auto table = parse(",material_1,material_2,m,\n0,b,a,0.5,\n,,,,\n1,c,a,1.5\n2,b,c,2,\n");
    EXPECT_THAT(table.names, ElementsAre("a", "b", "c"));
    EXPECT_THAT(table.metrics[0].values, ElementsAre(0.5, 1.5, 2));
}

TEST(DistanceTable, ASquareMatrix) {
    const auto read = [](std::string_view text) {
        const auto table = parse_distance_table(text, "nets/lpips.vgg.csv");
        EXPECT_THAT(table.names, ElementsAre("a", "b", "c"));
        EXPECT_EQ(table.metrics.at(0).metric, "lpips.vgg");
        return table.metrics.at(0).values;
    };
    for (const auto* const text :
         {",a,b,c\na,0,1,2\nb,1,0,3\nc,2,3,0\n", "name;c;a;b;\nb;3,0;1;0\na;2;0,0;1;\nc;0;2;3\n",
          ",a,b,c\na,0,1,2\nb,,,3\nc,,,\n", "Unnamed: 0,a,b,c\na,,,\nb,1,,\nc,2,3,\n"}) {
        EXPECT_THAT(read(text), ElementsAre(1, 2, 3)) << text;
    }
    // No matrix, but materials that are called as the columns are.
    EXPECT_THAT(parse("material_1,material_2,m\nm,material_2,4\n").metrics[0].values,
                ElementsAre(4));
}

TEST(DistanceTable, MatricesThatAreWrong) {
    for (const auto& [text, words] : std::vector<std::pair<std::string, std::string>>{
             {",a,b,c\na,0,1,2\nb,1,0,3\nc,2,4,0\n",
              "found 4 for \"b\" and \"c\", and 3 in line 3"},
             {",a,b\na,0.1,1\nb,1,0\n", "found \"a\" with itself at the distance 0.1"},
             {",a,b\na,0,1\n", "no row for \"b\""},
             {",a,b\na,0,1\nx,1,0\n", "found \"x\" before a row"},
             {",a,b\na,0,1\na,0,1\n", "line 3: found \"a\" again, which line 2 has"},
             {",a,a\na,0,0\n", "\"a\" twice"},
             {",a,,b\na,0,0,1\n", "without a name"},
             {",a,b\na,0,\nb,,0\n", "no distance"},
             {",a,b,c\na,0,1,\nb,1,0,\nc,,,0\n", "\"a\" and \"c\" are missing"},
             {",a,b\na,0,x\nb,1,0\n", "b: found \"x\""},
             {",a,b\na,0,1,5\nb,1,0\n", "found 4 fields; expected 3"},
             {",a,b\n0,0,1\n1,1,0\n", "square matrix with the names"},
         }) {
        EXPECT_THAT(complaint(text), HasSubstr(words)) << text;
    }
    EXPECT_THAT(complaint(",a,b\na,0,1\nb,1,0\n", {"x"}),
                AllOf(HasSubstr("no metric \"x\""), HasSubstr("file is: t")));
}

TEST(ListedDistances, SomePairsAreEnough) {
    const auto table = parse_listed_distances(
        "material_1,material_2,m,n\nd,c,1,2\nb,a,3,4\nd,a,5,6\nc,d,1,2\n", "t.csv", {});
    EXPECT_THAT(table.names, ElementsAre("a", "b", "c", "d"));
    EXPECT_THAT(table.pairs, ElementsAre(Pair{0, 1}, Pair{0, 3}, Pair{2, 3}));
    EXPECT_THAT(table.metrics.at(1).values, ElementsAre(4, 6, 2));
}

TEST(DistanceTable, NumbersThatAreNone) {
    for (const std::string bad : {"nan", "NaN", "inf", "-inf", "infinity", "-1", "", " 1", "1 ",
                                  "1,5", "0x10", "1e999", "one", "+1", "1_000", "nan(1)"}) {
        EXPECT_THAT(complaint("material_1,material_2,m\na,b,\"" + bad + "\"\n"),
                    AllOf(HasSubstr("t.csv, line 2"), HasSubstr("m: found \"" + bad + "\"")));
    }
}

TEST(DistanceTable, RowsAndHeadersThatAreNone) {
    EXPECT_THAT(complaint("material_1,material_2,m\na,b\n"),
                AllOf(HasSubstr("line 2"), HasSubstr("2 fields"), HasSubstr("3")));
    EXPECT_THAT(complaint("material_1,material_2,m\na,b,1,2\n"), HasSubstr("4 fields"));
    EXPECT_THAT(complaint("material_1,material_2,m\n"), HasSubstr("no pair"));
    EXPECT_THAT(complaint("\n\n"), HasSubstr("no row"));
    EXPECT_THAT(complaint("material_1,material_2\na,b\n"), HasSubstr("no metric"));
    EXPECT_THAT(complaint("a,b,1\n"), HasSubstr("material_1, material_2"));
    EXPECT_THAT(complaint("material_a,material_2,m\na,b,1\n"), HasSubstr("expected material_1"));
    EXPECT_THAT(complaint("material_1,material_2,m,m\na,b,1,2\n"), HasSubstr("\"m\" twice"));
    EXPECT_THAT(complaint("material_1,material_2,m,\na,b,1,2\n"), HasSubstr("without a name"));
}

TEST(DistanceTable, WhatProgressThrowsComesOut) {
    std::string text = "material_1,material_2,m\n";
    for (int i = 0; i < 100; ++i) {
        for (int j = i + 1; j < 100; ++j) {
            text += std::to_string(i) + ',' + std::to_string(j) + ",1\n";
        }
    }
    const auto stop = [](double share) {
        EXPECT_GT(share, 0);
        throw std::runtime_error("stop");
    };
    EXPECT_THROW(parse_distance_table(text, "t.csv", {}, stop), std::runtime_error);
    EXPECT_EQ(parse(text).pairs(), 4950U);
}

TEST(ReadInput, RefusesWhatIsNoFile) {
    const auto complaint_of = [](const std::string& path) {
        try {
            read_input(path);
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("none");
    };
    EXPECT_THAT(complaint_of("no-such-file.csv"), HasSubstr("cannot be opened: No such file"));
    EXPECT_THAT(complaint_of("/"), HasSubstr("not a regular file"));
    EXPECT_THAT(complaint_of("/dev/null"), HasSubstr("not a regular file"));
    const auto path = std::filesystem::path(::testing::TempDir()) /
                      ("merl-scan-input-" + std::to_string(::getpid()));
    std::ofstream(path).close();
    EXPECT_THAT(complaint_of(path), HasSubstr("is empty"));
    std::filesystem::resize_file(path, max_input_bytes + 1);  // sparse
    EXPECT_THAT(complaint_of(path), HasSubstr("1073741825 bytes"));
    std::ofstream(path) << "a\nb";
    EXPECT_EQ(read_input(path), "a\nb");
    std::filesystem::remove(path);
}

}  // namespace
}  // namespace merl::scan
