#include "scan/statistics/krippendorff.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <vector>

namespace merl::scan {
namespace {

/// Units of a table with a text per observer: one character a unit, a dot where there is no value.
/// `values` has the values in order.
std::vector<UnitCounts> units_of(const std::vector<std::string>& observers,
                                 std::string_view values) {
    std::vector<UnitCounts> units(observers[0].size(), UnitCounts(values.size()));
    for (const auto& observer : observers) {
        for (std::size_t u = 0; u < observer.size(); ++u) {
            if (observer[u] != '.') {
                ++units[u].at(values.find(observer[u]));
            }
        }
    }
    return units;
}

// K. Krippendorff, Computing Krippendorff's Alpha-Reliability, 2011, section D: four observers,
// twelve units, values missing; ordinal alpha 0.815.
TEST(Krippendorff, FourObserversWithMissingValues) {
    const auto units =
        units_of({"123321412...", "1233224125.3", ".3332342251.", "12332441251."}, "12345");
    EXPECT_NEAR(ordinal_alpha(units), 0.815, 0.0005);
}

// The same, section A: two observers, two values, where every difference function is the same;
// alpha 0.095.
TEST(Krippendorff, TwoObserversWithTwoValues) {
    EXPECT_NEAR(ordinal_alpha(units_of({"0100000000", "1110010010"}, "01")), 0.095, 0.0005);
}

// A. F. Hayes and K. Krippendorff, Answering the Call for a Standard Reliability Measure for Coding
// Data, 2007, table 1: 40 articles, five observers; ordinal alpha 0.7598. The interval
// is that of 4,000 draws of the articles in a plain Python program.
TEST(Krippendorff, FortyArticles) {
    const auto units = units_of(
        {"112.001122.01311211000201001111223222221", "1130000.21102311121000302102111122222221",
         "203000222100221123001.30.1012202.2232.21", ".13....0.10022...31.103021122..122...12.",
         "2..0001.2....3112..0.0..2.0..20.2.2222.1"},
        "0123");
    const auto alpha = ordinal_alpha(units, {.replicates = 2000, .seed = 1});
    EXPECT_NEAR(alpha.value, 0.7598, 0.00005);
    EXPECT_NEAR(alpha.interval.low, 0.622, 0.015);
    EXPECT_NEAR(alpha.interval.high, 0.842, 0.015);
}

TEST(Krippendorff, TooFewForAnInterval) {
    const BootstrapOptions options = {.replicates = 100, .seed = 1};
    const auto alpha = ordinal_alpha(units_of({"1213..", "1223.."}, "123"), options);
    EXPECT_EQ(alpha.too_few, "configurations with two votes or more: 4; expected 5 or more");
    EXPECT_TRUE(std::isnan(alpha.interval.low));
    // Judges who never differ have alpha 1 in every sample.
    const auto sure = ordinal_alpha(units_of({"123123123", "123123123"}, "123"), options);
    EXPECT_DOUBLE_EQ(sure.value, 1);
    EXPECT_TRUE(std::isnan(sure.interval.low));
    EXPECT_FALSE(sure.too_few.empty());
}

TEST(Krippendorff, Edges) {
    EXPECT_DOUBLE_EQ(ordinal_alpha(units_of({"123", "123"}, "123")), 1);
    EXPECT_TRUE(std::isnan(ordinal_alpha(units_of({"333", "333"}, "123"))));
    EXPECT_TRUE(std::isnan(ordinal_alpha(units_of({"1.3", ".2."}, "123"))));
    EXPECT_TRUE(std::isnan(ordinal_alpha({})));
    EXPECT_LT(ordinal_alpha(units_of({"1313", "3131"}, "123")), 0);
}

}  // namespace
}  // namespace merl::scan
