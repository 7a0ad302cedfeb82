#include "scan/select/selection_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "engine/base/error.h"
#include "scan/io/input.h"

namespace merl::scan {
namespace {

const std::string kHeader =
    "rank,left_1,left_2,right_1,right_2,x_left,x_right,\"y,_left\",\"y,_right\",agreement\n";

void expect_refused(const std::string& text, const std::vector<std::string>& words) {
    try {
        parse_selection(text, "s.csv");
        ADD_FAILURE() << "taken: " << text;
    } catch (const InputError& error) {
        for (const auto& word : words) {
            EXPECT_THAT(error.what(), ::testing::HasSubstr(word)) << text;
        }
    }
}

TEST(SelectionFile, IsRead) {
    const auto selection = parse_selection(kHeader +
                                               "1,a,b,c,d,1,2,4,0.5,0.0625\n"
                                               "2,a,c,b,d,1,1,3,2,0.5\n",
                                           "s.csv");
    EXPECT_EQ(selection.first_metric, "x");
    EXPECT_EQ(selection.second_metric, "y,");
    ASSERT_EQ(selection.configurations.size(), 2);
    const auto& first = selection.configurations[0];
    EXPECT_EQ(first.materials, (FourMaterials{"a", "b", "c", "d"}));
    EXPECT_EQ(first.first[1], 2);
    EXPECT_EQ(first.second[0], 4);
    EXPECT_EQ(first.agreement, 0.0625);
}

TEST(SelectionFile, BadFilesAreExplained) {
    expect_refused("a,b\n", {"s.csv, line 1", "rank,left_1"});
    expect_refused("rank,left_1,left_2,right_1,right_2,x_left,z_right,y_left,y_right,agreement\n",
                   {"line 1", "metrics"});
    expect_refused(kHeader, {"no row", "configuration to judge"});
    expect_refused(kHeader + "2,a,b,c,d,1,2,4,1,0.1\n", {"line 2", "found \"2\"", "expected 1"});
    expect_refused(kHeader + "1,a,b,c,d,1,2,4\n", {"8 fields", "expected 10"});
    expect_refused(kHeader + "1,a,b,c,d,1,nan,4,1,0.1\n", {"\"nan\"", "finite"});
    expect_refused(kHeader + "1,a,b,c,d,1,-2,4,1,0.1\n", {"\"-2\""});
    expect_refused(kHeader + "1,a,a,c,d,1,2,4,1,0.1\n", {"\"a\" twice"});
    expect_refused(kHeader + "1,a,b,c,d,2,1,4,1,0.1\n", {"do not disagree"});
    expect_refused(kHeader + "1,a,b,c,d,1,2,1,4,0.1\n", {"do not disagree"});
    expect_refused(kHeader + "1,a,b,c,d,1,1,4,4,0.1\n", {"do not disagree"});
}

}  // namespace
}  // namespace merl::scan
