#include "engine/base/csv_reader.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "engine/base/error.h"

namespace merl {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

using Rows = std::vector<std::vector<std::string>>;

Rows rows_of(std::string_view text) {
    CsvReader reader(text, "file.csv");
    Rows rows;
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        rows.push_back(fields);
    }
    EXPECT_EQ(reader.share(), 1);
    return rows;
}

std::string complaint(std::string_view text) {
    try {
        rows_of(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "none";
}

TEST(CsvReader, PlainRows) {
    EXPECT_EQ(rows_of("a,b\n1,2\n"), (Rows{{"a", "b"}, {"1", "2"}}));
    EXPECT_EQ(rows_of("a,b\r\n1,2"), (Rows{{"a", "b"}, {"1", "2"}}));
    EXPECT_EQ(rows_of(",\n"), (Rows{{"", ""}}));
    EXPECT_EQ(rows_of("a,"), (Rows{{"a", ""}}));
    EXPECT_EQ(rows_of(" a , b "), (Rows{{" a ", " b "}}));
}

TEST(CsvReader, RowsAreAsWideAsTheHeader) {
    const std::string text = "a,b\n1,2\n\n3\n";
    CsvReader reader(text, "file.csv");
    EXPECT_THAT(reader.header(), ElementsAre("a", "b"));
    std::vector<std::string> fields;
    EXPECT_TRUE(reader.next(fields));
    try {
        reader.next(fields);
        ADD_FAILURE() << "a row of one field was taken";
    } catch (const InputError& error) {
        EXPECT_STREQ(error.what(),
                     "file.csv, line 4: found 1 fields; expected 2, as in the header");
    }
    CsvReader empty("\n", "file.csv");
    EXPECT_THROW(empty.header(), InputError);
}

TEST(CsvReader, SaysWhichColumnsThereAre) {
    EXPECT_EQ(columns_text({"a"}), "1 column, \"a\"");
    EXPECT_EQ(columns_text({"a", "b"}), "2 columns, \"a,b\"");
    EXPECT_EQ(columns_text({"a;b", "c"}),
              "2 columns, \"a;b,c\" (semicolons separate columns where no comma is in the header, "
              "unless in quotes)");
    EXPECT_EQ(columns_text({"a", " b"}),
              "2 columns, \"a, b\" (blanks around a name are part of it)");
    EXPECT_EQ(columns_text(std::vector<std::string>(17, "x")),
              "17 columns, \"x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,x,...\"");
}

// The examples of RFC 4180, section 2.
TEST(CsvReader, QuotedRows) {
    EXPECT_EQ(rows_of("\"aaa\",\"bbb\",\"ccc\"\r\nzzz,yyy,xxx"),
              (Rows{{"aaa", "bbb", "ccc"}, {"zzz", "yyy", "xxx"}}));
    EXPECT_EQ(rows_of("\"aaa\",\"b\r\nbb\",\"ccc\"\r\nzzz,yyy,xxx"),
              (Rows{{"aaa", "b\r\nbb", "ccc"}, {"zzz", "yyy", "xxx"}}));
    EXPECT_EQ(rows_of("\"aaa\",\"b\"\"bb\",\"ccc\""), (Rows{{"aaa", "b\"bb", "ccc"}}));
    EXPECT_EQ(rows_of("\"\",\"\"\"\"\n"), (Rows{{"", "\""}}));
}

TEST(CsvReader, SkipsAByteOrderMarkAndEmptyLines) {
    EXPECT_EQ(rows_of("\xef\xbb\xbf"
                      "a\n\n\r\nb\n\n"),
              (Rows{{"a"}, {"b"}}));
    EXPECT_THAT(rows_of(""), IsEmpty());
    EXPECT_THAT(rows_of("\n\r\n"), IsEmpty());
    EXPECT_THAT(rows_of("\"\"\n"), ElementsAre(ElementsAre("")));
}

TEST(CsvReader, CountsLinesInsideQuotes) {
    CsvReader reader("\"a\nb\"\n\nc\nd", "file.csv");
    std::vector<std::string> fields;
    for (const std::uint64_t line : {1U, 4U, 5U}) {
        ASSERT_TRUE(reader.next(fields));
        EXPECT_EQ(reader.line(), line);
    }
    EXPECT_FALSE(reader.next(fields));
}

TEST(CsvReader, SaysWhatIsNoCsv) {
    EXPECT_THAT(complaint("a\n\"b\nc"), AllOf(HasSubstr("file.csv, line 2"), HasSubstr("closed")));
    EXPECT_THAT(complaint("a\nb\n\"c\"d"), AllOf(HasSubstr("line 3"), HasSubstr("closing quote")));
    EXPECT_THAT(complaint("a\"b\""), AllOf(HasSubstr("line 1"), HasSubstr("quote inside")));
    EXPECT_THAT(complaint("a\rb"), HasSubstr("carriage return"));
    EXPECT_THAT(complaint(std::string_view("a\n\0b", 4)),
                AllOf(HasSubstr("line 2"), HasSubstr("byte 0")));
    EXPECT_EQ(complaint(std::string(max_csv_fields - 1, ',')), "none");
    EXPECT_THAT(complaint(std::string(max_csv_fields, ',')), HasSubstr("4096 fields"));
}

Rows rows_below_header(std::string_view text) {
    CsvReader reader(text, "file.csv");
    Rows rows = {reader.header()};
    std::vector<std::string> fields;
    while (reader.next(fields)) {
        rows.push_back(fields);
    }
    return rows;
}

std::string complaint_below_header(std::string_view text) {
    try {
        rows_below_header(text);
    } catch (const InputError& error) {
        return error.what();
    }
    return "none";
}

TEST(CsvReader, SeparatorsAreThoseOfTheFirstLine) {
    const Rows expected = {{"a", "b"}, {"1", "2"}};
    EXPECT_EQ(rows_of("a;b\n1;2\n"), expected);
    EXPECT_EQ(rows_of("\na\tb\n1\t2\n"), expected);
    EXPECT_EQ(rows_of("\"a\";\"b\"\n1;2\n"), expected);
    // A comma in quotes separates nothing, and one outside them is stronger than what it may be of.
    EXPECT_EQ(rows_of("\"a,a\";b\n0,5;2\n"), (Rows{{"a,a", "b"}, {"0,5", "2"}}));
    EXPECT_EQ(rows_of("a;b,c\n1;2,3\n"), (Rows{{"a;b", "c"}, {"1;2", "3"}}));
    EXPECT_EQ(rows_of("a;b\tc\n1\t;2\n"), (Rows{{"a", "b\tc"}, {"1\t", "2"}}));
    EXPECT_EQ(rows_of("a\n1;2\n"), (Rows{{"a"}, {"1;2"}}));
    EXPECT_THAT(complaint("a;b\n\"1\",2\n"), HasSubstr("expected a semicolon or"));
}

TEST(CsvReader, WhatSpreadsheetsAndDataFramesAdd) {
    const Rows expected = {{"a", "b"}, {"1", "2"}, {"3", "4"}};
    EXPECT_EQ(rows_below_header("a,b,,\n1,2,,\n,,,\n3,4\n"), expected);
    EXPECT_EQ(rows_below_header(",,\n \na,b,,,,\n1,2,,,,\n,\n3,4,\n \n"), expected);
    EXPECT_EQ(rows_below_header(",a,b\n0,1,2\n17,3,4\n"), expected);
    EXPECT_EQ(rows_below_header(",,,\na;b\n1;2;;;\n3;4;\n"), expected);
    EXPECT_EQ(rows_below_header("\"\";\"a\";\"b\";\n\"1\";1;2;\n\"2\";3;4\n"), expected);
    EXPECT_EQ(rows_below_header("Unnamed: 0,a,b\n0,1,2\n1,3,4\n"), expected);
    // A field without content is one below a name.
    EXPECT_EQ(rows_below_header("a,b\n1,\n,2\n"), (Rows{{"a", "b"}, {"1", ""}, {"", "2"}}));
    CsvReader matrix(",a,\nx,1,\n", "file.csv");
    EXPECT_THAT(matrix.header_of_matrix(), ElementsAre("", "a"));
    std::vector<std::string> fields;
    EXPECT_TRUE(matrix.next(fields));
    EXPECT_THAT(fields, ElementsAre("x", "1"));
}

TEST(CsvReader, WhatIsBelowNoNameIsNotLeftOut) {
    EXPECT_THAT(
        complaint_below_header("a,b,\n1,2,3\n"),
        AllOf(HasSubstr("line 2"), HasSubstr("found \"3\" in column 3, which is without a name")));
    EXPECT_THAT(complaint_below_header("a,b\n1,,2\n"), HasSubstr("found 3 fields; expected 2"));
    EXPECT_THAT(complaint_below_header(",a,b\nx,1,2\n"),
                AllOf(HasSubstr("line 2"), HasSubstr("found \"x\" in the first column")));
    EXPECT_THAT(complaint_below_header(",a,b\n-1,1,2\n"), HasSubstr("found \"-1\""));
    EXPECT_THAT(complaint_below_header(",a,b\n1,2\n"), HasSubstr("found 2 fields; expected 3"));
}

TEST(CsvReader, ADecimalCommaIsNeverTakenForASeparator) {
    EXPECT_THAT(complaint_below_header("a,b\n1,5,2\n"),
                AllOf(HasSubstr("found 3 fields; expected 2"), HasSubstr("decimal comma")));
    EXPECT_THAT(complaint_below_header(",a,b\n1,5,2\nx,1,5,2\n"), HasSubstr("found 4 fields"));
    EXPECT_THAT(complaint_below_header("a,b,\n1,5,2\n"),
                AllOf(HasSubstr("found \"2\" in column 3"), HasSubstr("decimal comma")));
    for (const auto* const text : {"a,b,\n1,5,2,\n", "a,b\n1,5,\n", "a,b\n1,2\n1,5,\n"}) {
        EXPECT_THAT(complaint_below_header(text), HasSubstr("decimal comma")) << text;
    }
    EXPECT_THAT(complaint_below_header("a,b\n1,5,2,5\n"), HasSubstr("found 4 fields"));
    CsvReader commas("a,b", "file.csv");
    EXPECT_EQ(commas.number("1,5"), std::nullopt);
    EXPECT_EQ(commas.whole_number("1,0"), std::nullopt);
    EXPECT_THAT(commas.decimal_comma_hint("-1,5e3"), HasSubstr("semicolons"));
    for (const auto* const other : {"1.5", "1,5,0", "a,b", "x", ""}) {
        EXPECT_EQ(commas.decimal_comma_hint(other), "");
    }
}

TEST(CsvReader, Numbers) {
    CsvReader reader("a,b", "file.csv");
    EXPECT_EQ(reader.number("-1.5e3"), -1500);
    EXPECT_EQ(reader.magnitude("0"), 0);
    EXPECT_EQ(reader.magnitude("-1"), std::nullopt);
    EXPECT_EQ(reader.whole_number("12"), 12U);
    EXPECT_EQ(reader.whole_number("12.0"), 12U);
    for (const auto* const bad : {"12.00", "1.000", "1.5", "-1", "-1.0", ".0", "1e3", "12.", ""}) {
        EXPECT_EQ(reader.whole_number(bad), std::nullopt) << bad;
    }
    for (const auto* const bad : {"nan", "inf", "1e999", " 1", "+1", "0x1", "1.5.0", ""}) {
        EXPECT_EQ(reader.number(bad), std::nullopt) << bad;
    }
}

TEST(CsvReader, DecimalCommas) {
    for (const auto* const header : {"a;b", "a\tb"}) {
        CsvReader reader(header, "file.csv");
        EXPECT_EQ(reader.number("-1,5e-3"), -0.0015);
        EXPECT_EQ(reader.whole_number("7,0"), 7U);
        EXPECT_EQ(reader.number("3"), 3);
        EXPECT_EQ(reader.decimal_comma_hint("1,5"), "");
        for (const auto* const bad : {"1.234,5", "1,234.5", "1,2,3", ",", "1,5x"}) {
            EXPECT_EQ(reader.number(bad), std::nullopt) << bad;
        }
    }
}

TEST(CsvReader, OneDecimalMarkInAFile) {
    const auto complaint_of = [](const std::vector<std::string>& numbers) {
        CsvReader reader("a;b\n1;2\n", "file.csv");
        std::vector<std::string> fields;
        EXPECT_TRUE(reader.next(fields));
        try {
            for (const auto& number : numbers) {
                EXPECT_TRUE(reader.number(number)) << number;
                EXPECT_TRUE(reader.next(fields));
            }
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("none");
    };
    EXPECT_THAT(complaint_of({"0.5", "1,234"}),
                AllOf(HasSubstr("found \"1,234\""), HasSubstr("line 1"), HasSubstr("point")));
    EXPECT_THAT(complaint_of({"0,5", "1.234"}),
                AllOf(HasSubstr("found \"1.234\""), HasSubstr("decimal comma")));
}

}  // namespace
}  // namespace merl
