#include "engine/base/text.h"

#include <gtest/gtest.h>

#include <random>
#include <set>
#include <string>
#include <string_view>

namespace merl {
namespace {

TEST(Text, Utf8StaysAndOtherBytesAreEscaped) {
    EXPECT_EQ(as_utf8("plain\n\t"), "plain\n\t");
    EXPECT_EQ(as_utf8("\u00e9 \u20ac \U0001f600 \U0010ffff"),
              "\u00e9 \u20ac \U0001f600 \U0010ffff");
    EXPECT_EQ(as_utf8("a\xff"), "a\\xff");
    EXPECT_EQ(as_utf8("a\\xff"), "a\\x5cxff");  // another text, another result
    EXPECT_EQ(as_utf8("\\y"), "\\y");
    // RFC 3629: cut short, longer than needed, a surrogate, beyond the last character.
    EXPECT_EQ(as_utf8("\xe2\x82"), "\\xe2\\x82");
    EXPECT_EQ(as_utf8("\xc0\x80"), "\\xc0\\x80");
    EXPECT_EQ(as_utf8("\xe0\x9f\xbf"), "\\xe0\\x9f\\xbf");
    EXPECT_EQ(as_utf8("\xed\xa0\x80"), "\\xed\\xa0\\x80");
    EXPECT_EQ(as_utf8("\xf4\x90\x80\x80"), "\\xf4\\x90\\x80\\x80");
}

TEST(Text, EveryTextComesBack) {
    constexpr std::string_view kBytes("\\x5c\xc3\xa9\xff\x80 a\0\n", 13);
    std::mt19937 random(1);
    std::set<std::string> texts;
    std::set<std::string> written;
    for (int i = 0; i < 20000; ++i) {
        std::string text;
        for (std::size_t n = random() % 9; n > 0; --n) {
            text += kBytes[random() % kBytes.size()];
        }
        EXPECT_EQ(from_utf8(as_utf8(text)), text);
        EXPECT_EQ(from_utf8(printable(text)), text);
        written.insert(as_utf8(text));
        texts.insert(std::move(text));
    }
    EXPECT_EQ(written.size(), texts.size());
}

TEST(Text, HiddenCharactersArePrinted) {
    EXPECT_EQ(printable("a\nb\x1b[31m\x7f"), "a\\x0ab\\x1b[31m\\x7f");
    EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
    EXPECT_EQ(printable("\u009b\u00ad\u200b\u202e\ufeff"),
              "\\xc2\\x9b\\xc2\\xad\\xe2\\x80\\x8b\\xe2\\x80\\xae\\xef\\xbb\\xbf");
    EXPECT_EQ(printable("\u00e9 \u0301"), "\u00e9 \u0301");
    char32_t last = 0;
    for (const auto range : hidden_characters()) {
        EXPECT_LE(range.first, range.last);
        EXPECT_TRUE(range.first == 0 || range.first > last);
        last = range.last;
    }
}

}  // namespace
}  // namespace merl
