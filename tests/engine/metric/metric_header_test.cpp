#include "engine/metric/metric_header.h"

#include <gtest/gtest.h>

#include <string>

#include "engine/base/error.h"

namespace merl::engine {
namespace {

TEST(MetricHeader, HasWhatTheCommentsSay) {
    const auto header = parse_metric_header(
        "// title: A metric\n"
        "// formula: sqrt( sum\n"
        "//     of squares )\n"
        "// A comment that is nothing of this: it begins with a capital.\n"
        "//\n"
        "//source:Somebody 2001\r\n"
        "// degree: 2/3\n"
        "// parameter: white = 100 in [1, 1e3] reflectance that is white, 1/sr\n"
        "// parameter: epsilon_2=1e-3 in [0,1] added: before the logarithm\n"
        "\n"
        "// title: not in the header\n",
        "my.glsl");
    EXPECT_EQ(header.title, "A metric");
    EXPECT_EQ(header.formula, "sqrt( sum of squares )");
    EXPECT_EQ(header.source, "Somebody 2001");
    EXPECT_EQ(header.degree_text, "2/3");
    EXPECT_DOUBLE_EQ(header.degree, 2.0 / 3.0);
    const std::vector<MetricParameter> expected = {
        {"white", 100, 1, 1000, "reflectance that is white, 1/sr"},
        {"epsilon_2", 1e-3, 0, 1, "added: before the logarithm"}};
    EXPECT_EQ(header.parameters, expected);
    EXPECT_TRUE(header.fitted.empty());
}

constexpr const char* kHash = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";

TEST(MetricHeader, SaysWhatTheMetricWasFittedTo) {
    const std::string other(64, 'a');
    const auto header = parse_metric_header("// fitted: " + std::string(kHash) +
                                                "\tSomebody 2019,\n"
                                                "//   the training part\n"
                                                "// fitted: " +
                                                other + "  more\n",
                                            "my.glsl");
    const std::vector<FittedTo> expected = {{kHash, "Somebody 2019, the training part"},
                                            {other, "more"}};
    EXPECT_EQ(header.fitted, expected);
}

TEST(MetricHeader, MayBeEmpty) {
    EXPECT_EQ(parse_metric_header("", "my.glsl").degree, 0);
    EXPECT_EQ(parse_metric_header("float x;\n// degree: 2\n", "my.glsl").degree, 0);
}

void expect_refused(const std::string& text, const std::string& part) {
    try {
        parse_metric_header(text, "my.glsl");
        FAIL() << text;
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::input);
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
}

TEST(MetricHeader, WrongLinesAreNamed) {
    expect_refused("// title: x\n// tilte: y\n", "my.glsl:2: \"tilte:\"");
    expect_refused("// title: x\n// title: y\n", "my.glsl:2: a second \"title:\"");
    expect_refused("// title:\n", "my.glsl:1: \"title:\" has no value");
    for (const char* degree : {"3", "0", "-2", "1/2", "2.0", "two", "2/3/4"}) {
        expect_refused(std::string("// degree: ") + degree, "expected 2, 1 or 2/3");
    }
    for (const char* parameter :
         {"x", "x = 1", "x = 1 in [0, 2]", "x = 1 in [0, 2 d", "x = in [0, 2] d",
          "x = 1 in 0, 2] d", "x = 1.5.5 in [0, 2] d", "x = nan in [0, 2] d", "x = 1 in [0, inf] d",
          "x = 0x1 in [0, 2] d", "x = 1 in [0] d", "= 1 in [0, 2] d"}) {
        expect_refused(std::string("// parameter: ") + parameter, "my.glsl:1: ");
    }
    expect_refused("// parameter: X = 1 in [0, 2] d", "called \"X\"");
    expect_refused("// parameter: a-b = 1 in [0, 2] d", "called \"a-b\"");
    expect_refused("// parameter: x = 3 in [0, 2] d", "expected a number in [0, 2]");
    expect_refused("// parameter: x = 1 in [2, 0] d", "expected a number in [2, 0]");
    expect_refused("// parameter: x = 1 in [0, 2] d\n// parameter: x = 1 in [0, 2] d",
                   "my.glsl:2: a second parameter x");
    const std::string hash = kHash;
    const std::string words = " Somebody 2019";
    for (const auto& fitted :
         {std::string(), hash, hash + " ", hash.substr(1) + words, std::string(65, '0') + words,
          std::string(64, 'g') + words, std::string(64, 'A') + words, words + hash}) {
        expect_refused("// title: x\n// fitted: " + fitted,
                       "my.glsl:2: what the metric was fitted");
    }
    expect_refused("// fitted: " + hash + " x\n// fitted: " + hash + " y",
                   "my.glsl:2: a second \"fitted:\"");
}

TEST(MetricHeader, ASummary) {
    const auto header = parse_metric_header(
        "// window: near the highlight,\n//   all of it\n// parameter: x = 1 in [0, 2] d\n"
        "// features: 7\n// window: far the rest\n",
        "my.glsl");
    EXPECT_EQ(header.windows, (std::vector<MetricWindow>{{"near", "the highlight, all of it"},
                                                         {"far", "the rest"}}));
    EXPECT_EQ(header.features, 7U);
    EXPECT_EQ(parse_metric_header("// degree: 2\n", "my.glsl").features, 0U);
}

TEST(MetricHeader, WrongLinesOfASummaryAreNamed) {
    for (const char* features : {"", "0", "65", "-1", "1.5", "two", "2 of them"}) {
        expect_refused(std::string("// window: w x\n// features: ") + features,
                       "my.glsl:2: the features are ");
    }
    for (const char* window : {"", "w", "W x", "a-b x", "1w x"}) {
        expect_refused(std::string("// window: ") + window, "my.glsl:1: the window is ");
    }
    expect_refused("// window: w x\n// features: 1\n// features: 1\n", "my.glsl:3: a second");
    expect_refused("// window: w x\n// window: w y\n", "my.glsl:2: a second window w");
    expect_refused("// parameter: w = 1 in [0, 2] d\n// window: w x\n",
                   "my.glsl:2: a second parameter w");
    expect_refused("// window: w x\n// parameter: w = 1 in [0, 2] d\n",
                   "my.glsl:2: a second window w");
    std::string many;
    for (int i = 0; i < 33; ++i) {
        many += "// window: w" + std::to_string(i) + " x\n";
    }
    expect_refused(many, "my.glsl:33: more than 32 windows");
    expect_refused("// window: w x\n", "windows without \"// features: N\"");
    expect_refused("// features: 1\n", "features without a \"// window:");
    expect_refused("// window: w x\n// degree: 2\n// features: 1\n", "a degree beside features");
}

}  // namespace
}  // namespace merl::engine
