#include "scan/io/csv.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <random>
#include <system_error>

namespace merl::scan {
namespace {

std::string number(double value) {
    std::string text = "=";
    append_number(text, value);
    return text;
}

TEST(CsvField, OrdinaryTextIsLeftAlone) {
    EXPECT_EQ(csv_field("alum-bronze"), "alum-bronze");
    EXPECT_EQ(csv_field(""), "");
    EXPECT_EQ(csv_field(" two words; 'single' "), " two words; 'single' ");
    EXPECT_EQ(csv_field("\xC3\xA9mail"), "\xC3\xA9mail");
    EXPECT_EQ(csv_field("=1+1"), "=1+1");
}

TEST(CsvField, SpecialCharactersAreQuoted) {
    EXPECT_EQ(csv_field("a,b"), "\"a,b\"");
    EXPECT_EQ(csv_field("line\nbreak"), "\"line\nbreak\"");
    EXPECT_EQ(csv_field("carriage\rreturn"), "\"carriage\rreturn\"");
    EXPECT_EQ(csv_field("the \"best\""), "\"the \"\"best\"\"\"");
    EXPECT_EQ(csv_field("\""), "\"\"\"\"");
}

TEST(CsvNumber, IsShortest) {
    EXPECT_EQ(number(0), "=0");
    EXPECT_EQ(number(0.1), "=0.1");
    EXPECT_EQ(number(1.0 / 3), "=0.3333333333333333");
    EXPECT_EQ(number(1e22), "=1e+22");
    EXPECT_EQ(number(std::numeric_limits<double>::denorm_min()), "=5e-324");
}

TEST(CsvNumber, ReadsBackTheSame) {
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> exponent(-320, 308);
    for (int i = 0; i < 10'000; ++i) {
        const double value = std::pow(10.0, exponent(random));
        ASSERT_EQ(std::strtod(number(value).c_str() + 1, nullptr), value);
    }
    const double largest = std::numeric_limits<double>::max();
    EXPECT_EQ(std::strtod(number(largest).c_str() + 1, nullptr), largest);
}

TEST(WriteAll, AFullDiskIsReported) {
    const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
    ASSERT_GE(full, 0);
    EXPECT_NO_THROW(write_all(full, ""));
    try {
        write_all(full, "text");
        ADD_FAILURE() << "nothing thrown";
    } catch (const std::system_error& error) {
        EXPECT_EQ(error.code().value(), ENOSPC);
    }
    ::close(full);
}

TEST(WriteAll, ABadDescriptorIsReported) {
    EXPECT_THROW(write_all(-1, "text"), std::system_error);
}

}  // namespace
}  // namespace merl::scan
