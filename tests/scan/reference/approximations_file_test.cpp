#include "scan/reference/approximations_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace merl::scan {
namespace {

using ::testing::HasSubstr;

TEST(ApproximationsFile, IsReadWhateverElseItHas) {
    const auto rows = parse_approximations(
        "label,y,original,approximation,x,x_rank\n"
        "q,0.5,o/b,q/b,2,?\n"
        "p,1e-3,o/b,p/b,3,?\n"
        "p,7,o/a,p/a,0,?\n",
        "a.csv", "x", "y");
    EXPECT_EQ(rows, (std::vector<ApproximationDistances>{
                        {"o/a", "p/a", 0, 7}, {"o/b", "p/b", 3, 1e-3}, {"o/b", "q/b", 2, 0.5}}));
}

TEST(ApproximationsFile, BadFilesAreExplained) {
    const auto complaint = [](const std::string& text) -> std::string {
        try {
            parse_approximations(text, "a.csv", "x", "y");
        } catch (const InputError& error) {
            return error.what();
        }
        return "";
    };
    const std::string header = "original,approximation,x,y\n";
    EXPECT_EQ(complaint(header + "o/a,p/a,1,2\n"), "");
    EXPECT_THAT(
        complaint("original,approximation,x\n"),
        ::testing::AllOf(HasSubstr("a.csv"), HasSubstr("\"y\""), HasSubstr("approximations.csv")));
    EXPECT_THAT(complaint("original,approximation,x,y,x\n"), HasSubstr("one \"x\""));
    EXPECT_THAT(complaint(header), HasSubstr("no row"));
    EXPECT_THAT(complaint(header + "o/a,p/a,1,2\no/a,,1,2\n"),
                HasSubstr("line 3: approximation: found no name"));
    EXPECT_THAT(complaint(header + "o/a,p/a,1,-2\n"), HasSubstr("line 2: y: found \"-2\""));
    EXPECT_THAT(complaint(header + "o/a,p/a,nan,2\n"), HasSubstr("x: found \"nan\""));
    EXPECT_THAT(complaint(header + "o/a,p/a,1,2\no/b,p/b,1,2\no/a,p/a,1,2\n"),
                HasSubstr("\"p/a\" of \"o/a\" twice"));
}

}  // namespace
}  // namespace merl::scan
