#include "engine/metric/double_literals.h"

#include <gtest/gtest.h>

namespace merl::engine {
namespace {

/// In the body of a function.
std::string body(const std::string& text) {
    const std::string head = "float f(float x) {\n";
    const auto whole = with_double_literals(head + text + "}");
    EXPECT_TRUE(whole.starts_with(head) && whole.ends_with("}")) << whole;
    return whole.substr(head.size(), whole.size() - head.size() - 1);
}

TEST(DoubleLiterals, OfAnyForm) {
    EXPECT_EQ(body("return x > 0.5 ? .1 : 3.;"), "return x > 0.5lf ? .1lf : 3.lf;");
    EXPECT_EQ(body("1e5 1E-5 1.5e+3 0.1f 2.F -7.0"), "1e5lf 1E-5lf 1.5e+3lf 0.1lf 2.lf -7.0lf");
    EXPECT_EQ(body("vec3(0.1, 0.2, 0.3).x*0.5"), "vec3(0.1lf, 0.2lf, 0.3lf).x*0.5lf");
    EXPECT_EQ(body("{ { 0.1; } } 0.2"), "{ { 0.1lf; } } 0.2lf");
}

TEST(DoubleLiterals, LeaveEverythingElse) {
    for (const std::string same :
         {"1 10u 0x1e5 0xffu 07", "1.0lf 2.0LF", "x1.y0 m.rgb[0].y a2e5 _1e5", "e5 v.e1"}) {
        EXPECT_EQ(body(same), same);
    }
}

TEST(DoubleLiterals, OutsideFunctionsTheCompilerComputes) {
    const std::string outside =
        "const float k = log(2.0);\nstruct S { float a; };\nconst float t[2] = { 0.1, log(0.3) };\n"
        "#line 7 \"lib/x.glsl\"\n";
    EXPECT_EQ(with_double_literals(outside), outside);
    EXPECT_EQ(with_double_literals("float f() { return 0.1; }\n" + outside +
                                   "float g() {\n#line 3\n0.2}"),
              "float f() { return 0.1lf; }\n" + outside + "float g() {\n#line 3\n0.2lf}");
    EXPECT_EQ(with_double_literals("} } 0.1 } f() { 0.1"), "} } 0.1 } f() { 0.1lf");
    EXPECT_EQ(with_double_literals(""), "");
}

}  // namespace
}  // namespace merl::engine
