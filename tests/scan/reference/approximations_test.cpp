#include "scan/reference/approximations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "engine/base/error.h"

namespace merl::scan {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

std::vector<std::string> sorted(std::vector<std::string> names) {
    std::ranges::sort(names);
    return names;
}

TEST(Approximations, AreTheMaterialsOfTheSameName) {
    const auto names = sorted({"b/chrome", "b/steel", "a/steel", "a/brass", "m/chrome", "m/steel",
                               "m/gold", "z/tin", "unlabelled"});
    const auto found = find_approximations(names, "m");
    const auto place = [&](const std::string& name) {
        return static_cast<std::uint32_t>(std::ranges::find(names, name) - names.begin());
    };
    EXPECT_EQ(found.reference, "m");
    EXPECT_THAT(found.labels, ElementsAre("a", "b"));
    EXPECT_THAT(found.list, ElementsAre(Approximation{place("m/chrome"), place("b/chrome"), 1},
                                        Approximation{place("m/steel"), place("a/steel"), 0},
                                        Approximation{place("m/steel"), place("b/steel"), 1}));
    EXPECT_THAT(found.lacking, ElementsAre(Lacking{"chrome", {"a"}}, Lacking{"gold", {"a", "b"}}));
    EXPECT_THAT(found.without_original, ElementsAre("a/brass", "z/tin"));
    EXPECT_THAT(found.unrelated, ElementsAre("z"));
    EXPECT_THAT(pairs_of(found), ElementsAre(Pair{place("a/steel"), place("m/steel")},
                                             Pair{place("b/chrome"), place("m/chrome")},
                                             Pair{place("b/steel"), place("m/steel")}));
}

TEST(Approximations, ALabelEndsAtTheFirstSlash) {
    const std::vector<std::string> names = {"a/x/y", "m/x", "m/x/y", "mm/x/y"};
    const auto found = find_approximations(names, "m");
    EXPECT_THAT(found.labels, ElementsAre("a", "mm"));
    EXPECT_THAT(found.list, ElementsAre(Approximation{2, 0, 0}, Approximation{2, 3, 1}));
    EXPECT_THAT(found.lacking, ElementsAre(Lacking{"x", {"a", "mm"}}));
    EXPECT_THAT(found.without_original, IsEmpty());
}

/// What the error says, and whose fault it is.
std::string error_of(std::vector<std::string> names, const std::string& reference, Fault fault) {
    try {
        find_approximations(sorted(std::move(names)), reference);
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), fault);
        return error.what();
    }
    return "no error";
}

TEST(Approximations, ErrorsSayWhatThereIs) {
    EXPECT_THAT(error_of({"a/x", "b/x"}, "m", Fault::usage),
                AllOf(HasSubstr("\"m\""), HasSubstr("labels are: a, b")));
    EXPECT_THAT(error_of({"chrome", "steel"}, "m", Fault::usage),
                AllOf(HasSubstr("no labels"), HasSubstr("\"chrome\""), HasSubstr("\"m/NAME\"")));
    EXPECT_THAT(error_of({"m/x", "m/y"}, "m", Fault::input), HasSubstr("another database"));
    EXPECT_THAT(error_of({"m/x", "m/y", "a/v", "a/w"}, "m", Fault::input),
                AllOf(HasSubstr("x, y"), HasSubstr("\"a\" v, w")));
    std::vector<std::string> many;
    for (int i = 0; i < 4000; ++i) {
        many.push_back("m/" + std::to_string(i));
        many.push_back("label" + std::to_string(i) + "/" + std::to_string(i));
    }
    EXPECT_THAT(error_of(many, "m", Fault::input), HasSubstr("4000 labels"));
}

}  // namespace
}  // namespace merl::scan
