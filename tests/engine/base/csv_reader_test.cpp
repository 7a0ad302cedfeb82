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
    EXPECT_EQ(columns_text({"a", "b", ""}),
              "3 columns, \"a,b,\", the last without a name (a comma at the end of the line "
              "begins one more)");
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

}  // namespace
}  // namespace merl
