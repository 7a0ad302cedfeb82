#include "scan/votes/survey_file.h"

#include <gtest/gtest.h>

namespace merl::scan {
namespace {

TEST(SurveyFile, IsToldFromOtherFilesByItsHeader) {
    EXPECT_TRUE(is_survey("judge,question,answer\nanna,comments,none\n"));
    EXPECT_TRUE(is_survey("\xef\xbb\xbfjudge,question,answer\r\n"));
    EXPECT_TRUE(is_survey("judge,question,answer"));
    EXPECT_TRUE(is_survey("judge;question;answer;\n"));
    EXPECT_FALSE(is_survey("judge,question,answers\n"));
    EXPECT_FALSE(is_survey("\"judge,question,answer\n"));
    EXPECT_FALSE(is_survey("judge,trial,configuration\n"));
    EXPECT_FALSE(is_survey("judge,question"));
    EXPECT_FALSE(is_survey(""));
}

}  // namespace
}  // namespace merl::scan
