#include "engine/metric/metric_kernels.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <spirv-tools/libspirv.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "engine/base/error.h"
#include "engine/metric/metric_header.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

/// SPIRV-Tools' validator has nothing to say.
void expect_valid(const std::vector<std::uint32_t>& spirv, const std::string& what) {
    spvtools::SpirvTools tools(SPV_ENV_VULKAN_1_2);
    tools.SetMessageConsumer(
        [&](spv_message_level_t, const char*, const spv_position_t&, const char* message) {
            ADD_FAILURE() << what << ": " << message;
        });
    EXPECT_TRUE(tools.Validate(spirv)) << what;
}

void expect_valid(const Metric& metric, const device::FloatControls& floats = {.float64 = true}) {
    const auto kernels = compile_kernels(metric, floats);
    for (const auto* kernel : {&kernels.weigh, &kernels.prepare, &kernels.norms, &kernels.ranges,
                               &kernels.slopes, &kernels.check, &kernels.degree}) {
        if (!kernel->empty()) {
            expect_valid(*kernel, metric.name + " beside the difference");
        }
    }
    if (metric.is_summary()) {
        for (const auto* kernel : {&kernels.window, &kernels.window_parts, &kernels.window_sums}) {
            expect_valid(*kernel, metric.name + " summary");
        }
        EXPECT_EQ(kernels.feature.empty(), metric.has_twin());
        if (!kernels.feature.empty()) {
            expect_valid(kernels.feature, metric.name + " feature");
        }
        return;
    }
    expect_valid(kernels.difference, metric.name + " difference");
    EXPECT_EQ(kernels.degree.empty(), metric.has_twin() || !metric.has_degree());
    if (metric.has_degree() && floats.float64) {
        const auto float64 = compile_float64_kernels(metric, floats);
        for (const auto* kernel : {&float64.weigh, &float64.grid, &float64.sums}) {
            expect_valid(*kernel, metric.name + " in float64");
        }
    }
}

TEST(MetricKernels, OfTheWholeLibraryAreValid) {
    for (const auto& metric : metrics()) {
        expect_valid(metric);
        Metric of_a_user = metric;
        of_a_user.twin = {};
        expect_valid(of_a_user);
    }
    for (const auto& metric : framework_test_metrics()) {
        expect_valid(metric);
    }
}

/// The words of an instruction: OpCapability with one operand, OpExecutionMode of any entry point.
bool has_capability(const std::vector<std::uint32_t>& spirv, std::uint32_t capability) {
    const std::array<std::uint32_t, 2> words = {2U << 16U | 17U, capability};
    return std::search(spirv.begin(), spirv.end(), words.begin(), words.end()) != spirv.end();
}

bool has_mode(const std::vector<std::uint32_t>& spirv, std::uint32_t mode, std::uint32_t width) {
    for (std::size_t i = 0; i + 3 < spirv.size(); ++i) {
        if (spirv[i] == (4U << 16U | 16U) && spirv[i + 2] == mode && spirv[i + 3] == width) {
            return true;
        }
    }
    return false;
}

TEST(MetricKernels, DeclareWhatTheDeviceHasAndNothingElse) {
    constexpr std::uint32_t kFloat64 = 10;
    constexpr std::uint32_t kKeepsNan = 4461;
    constexpr std::uint32_t kNearest = 4462;
    for (const auto& metric : metrics()) {
        const device::FloatControls without = {.to_nearest = true, .keeps_nan = true};
        if (metric.is_summary()) {  // nothing of it is without float64
            EXPECT_THROW(compile_kernels(metric, without), std::logic_error);
            continue;
        }
        expect_valid(metric, without);
        const auto kernels = compile_kernels(metric, without);
        EXPECT_TRUE(kernels.weigh.empty() && kernels.prepare.empty());
        for (const auto* kernel :
             {&kernels.difference, &kernels.norms, &kernels.ranges, &kernels.slopes}) {
            EXPECT_FALSE(has_capability(*kernel, kFloat64)) << metric.name;
            EXPECT_EQ(has_mode(*kernel, kNearest, 32), !kernel->empty()) << metric.name;
            EXPECT_FALSE(has_mode(*kernel, kNearest, 64)) << metric.name;
        }
    }
    Metric of_a_user = find_metric("cwcbrt");
    of_a_user.twin = {};
    const device::FloatControls all = {
        .float64 = true, .to_nearest = true, .both_to_nearest = true, .keeps_nan = true};
    expect_valid(of_a_user, all);
    const auto kernels = compile_kernels(of_a_user, all);
    EXPECT_TRUE(has_mode(kernels.check, kKeepsNan, 32));
    EXPECT_TRUE(has_mode(kernels.prepare, kNearest, 32));
    EXPECT_TRUE(has_mode(kernels.prepare, kNearest, 64));
    EXPECT_FALSE(has_mode(kernels.difference, kKeepsNan, 32));
    const auto plain = compile_kernels(of_a_user);
    EXPECT_FALSE(has_mode(plain.check, kKeepsNan, 32) || has_mode(plain.check, kNearest, 32));
    EXPECT_THROW(compile_kernels(of_a_user, {}), std::logic_error);
}

const std::string kTransform = "vec3 transform(vec3 f, Voxel v) { return f; }\n";
const std::string kWeight = "float weight(Voxel v) { return 1.0; }\n";
const std::string kDifference = "float difference(vec3 a, vec3 b) { return distance(a, b); }\n";

/// The file is refused with a message that has all these parts.
void expect_refused(const std::string& source, const std::vector<std::string>& parts) {
    try {
        compile_kernels(test::metric_of(source));
        FAIL() << source;
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::input);
        for (const auto& part : parts) {
            EXPECT_NE(std::string(error.what()).find(part), std::string::npos)
                << part << " in: " << error.what();
        }
        EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
    }
}

TEST(MetricKernels, OfAUsersFileAreValid) {
    expect_valid(test::metric_of(kTransform + kWeight + kDifference));
    expect_valid(test::metric_of("// degree: 1\n" + kTransform + kWeight +
                                 "float difference(float d) { return abs(d); }"));
    expect_valid(
        test::metric_of("// parameter: alpha = 1e-05 in [0, 1] how much\n"
                        "#include \"lib/cielab.glsl\"\n"
                        "vec3 transform(vec3 f, Voxel v) { return alpha * cielab(f); }\n" +
                        kWeight + kDifference));
}

TEST(MetricKernels, ErrorsHaveTheLineOfTheFile) {
    expect_refused(kTransform + kWeight + "float difference(vec3 a, vec3 b) { return colour; }\n",
                   {"./my.glsl:3: ", "'colour'", "undeclared"});
    expect_refused("// degree: 2\n\nvec3 transform(vec3 f, Voxel v) { return f }\n",
                   {"./my.glsl:3: ", "syntax error"});
    expect_refused(kTransform + "\n" + kWeight + "#include \"lib/nothing.glsl\"\n",
                   {"./my.glsl:4: ", "lib/nothing.glsl"});
}

TEST(MetricKernels, AMissingFunctionIsNamed) {
    expect_refused(kWeight + kDifference, {"./my.glsl", "vec3 transform(vec3 f, Voxel v)"});
    expect_refused(kTransform + kDifference, {"./my.glsl", "float weight(Voxel v)"});
    expect_refused(kTransform + kWeight, {"float difference(vec3 a, vec3 b)", "degree"});
    expect_refused("// degree: 2\n" + kTransform + kWeight + kDifference,
                   {"float difference(float d)", "degree"});
    expect_refused("", {"./my.glsl", "there is no"});
}

TEST(MetricKernels, AWrongSignatureIsRefused) {
    expect_refused("float transform(vec3 f, Voxel v) { return 1.0; }\n" + kWeight + kDifference,
                   {"./my.glsl:1: ", "transform"});
    expect_refused(kTransform + "float weight() { return 1.0; }\n" + kDifference,
                   {"float weight(Voxel v)"});
}

TEST(MetricKernels, RecursionIsRefused) {
    expect_refused(kTransform + kWeight +
                       "float f(float x) { return x < 1.0 ? x : f(x - 1.0); }\n"
                       "float difference(vec3 a, vec3 b) { return f(a.x); }\n",
                   {"./my.glsl", "recursion"});
}

TEST(MetricKernels, NothingButTheLibraryCanBeIncluded) {
    for (const char* name : {"/etc/passwd", "../lib/cielab.glsl", "framework/metric.glsl",
                             "chosen_metric.glsl", "metric", "./my.glsl"}) {
        expect_refused(
            "#include \"" + std::string(name) + "\"\n" + kTransform + kWeight + kDifference,
            {"./my.glsl:1: ", name});
    }
}

TEST(MetricKernels, OfAFileWithLoopsAreValid) {
    expect_valid(test::metric_of(kTransform + kWeight +
                                 "float difference(vec3 a, vec3 b) {\n"
                                 "    float s = 0.0;\n"
                                 "    for (int i = 0; i < 3; ++i) { s += abs(a[i] - b[i]); }\n"
                                 "    while (s > 1e9) { s *= 0.5; }\n"
                                 "    return s;\n}\n"));
}

TEST(MetricKernels, AFileMayHaveAnyName) {
    auto metric = test::metric_of(kTransform + kWeight + kDifference);
    for (const char* name : {"framework/metric.glsl", "metric", "a\"b\n\\.glsl"}) {
        metric.file = name;
        expect_valid(metric);
    }
}

const std::string kRest = kTransform + kWeight + kDifference;

TEST(MetricKernels, TheKernelsAreOutOfReach) {
    expect_refused("layout(binding = 3) buffer B { float b[]; };\n" + kRest, {":1: ", "layout"});
    expect_refused("\nshared float x[100];\n" + kRest, {":2: ", "shared"});
    expect_refused("float f() { return gl_GlobalInvocationID.x; }\n" + kRest, {":1: ", "gl_"});
    expect_refused("/* two\nlines */\n#extension GL_NV_x : enable\n" + kRest,
                   {":3: ", "#extension"});
    expect_refused("# version 100\n" + kRest, {":1: ", "#version"});
    expect_refused("#line 7\n" + kRest, {":1: ", "#line"});
    expect_refused("#pragma optimize(off)\n" + kRest, {":1: ", "#pragma"});
    expect_valid(test::metric_of("// layout, gl_x, # and \\ in a comment /* do\n" + kRest));
}

TEST(MetricKernels, NothingIsHiddenInAMacroOrAComment) {
    expect_refused(
        "#define L(x, y) x##y\nL(lay, out)(binding = 3) buffer B { float b[]; };\n" + kRest,
        {":2: ", "layout"});
    expect_refused("lay\\\nout(binding = 3) buffer B { float b[]; };\n" + kRest, {"layout"});
    expect_refused("#define S sha\\\nred\nS float x[100];\n" + kRest, {":3: ", "shared"});
    expect_refused("/*/ // */ shared float x[100];\n" + kRest, {":1: ", "shared"});
    expect_refused(
        "#define G gl_Global\n#define H(x) x##InvocationID\n#define I(x) H(x)\n"
        "float f() { return float(I(G).x); }\n" +
            kRest,
        {":4: ", "gl_"});
    expect_refused("#error not today\n" + kRest, {":1: ", "not today"});
    expect_refused("#include \"lib/cielab.glsl\"\n\n#line 3\n" + kRest, {":3: ", "#line"});
}

/// `body` is that of the difference.
void expect_difference_refused(const std::string& body, const std::vector<std::string>& parts,
                               const std::string& before = "") {
    expect_refused(
        kTransform + kWeight + before + "float difference(vec3 a, vec3 b) {\n" + body + "\n}\n",
        parts);
}

TEST(MetricKernels, OnlyArithmeticIsAllowed) {
    for (const char* statement : {"barrier();",
                                  "memoryBarrier();",
                                  "memoryBarrierShared();",
                                  "groupMemoryBarrier();",
                                  "a.x = subgroupAdd(a.x);",
                                  "a = texelFetch(grid, 0).xyz;",
                                  "guard_faults = 0;",
                                  "guard_loops = 0;",
                                  "a.x = guard_min(a.x, b.x);",
                                  "guard_loop();",
                                  "a.x = float(kTile);",
                                  "a.x = float(materials);",
                                  "finding.kind = 0;",
                                  "atomicMin(finding.kind, 0);",
                                  "a.x = float(bitfieldExtract(7u, 30, 9));",
                                  "a.x = float(findMSB(7u));",
                                  "look(0, uvec2(0), 0);",
                                  "a.x = interpolateAtCentroid(a.x);",
                                  "demote;",
                                  "discard;"}) {
        expect_difference_refused(std::string("a.x += 1.0;\n") + statement + "\nreturn a.x;",
                                  {"./my.glsl:5: "});
    }
    expect_difference_refused("a.x += 1.0;\nbarrier();\nreturn a.x;",
                              {"./my.glsl:5: ", "difference()"});
    expect_difference_refused("return a.x + texelFetch(grid, 0).x;", {"./my.glsl:4: ", "grid"});
}

TEST(MetricKernels, VariablesOfTheWholeFileAreRefused) {
    for (const char* variable : {"float s;", "float s = 0.0;", "float s[3];", "Voxel s;"}) {
        expect_difference_refused("return a.x;", {"./my.glsl: ", "\"s\"", "whole file"},
                                  std::string(variable) + "\n");
    }
    expect_difference_refused("return s;", {"\"s\""},
                              "float f() { return 2.0; }\nfloat s = f();\n");
    expect_valid(test::metric_of(
        "const float s = 2.0 * sin(1.0);\nconst float t[3] = float[](1.0, s, 0.0);\n" + kTransform +
        kWeight +
        "float difference(vec3 a, vec3 b) {\n"
        "    int i = a.x > b.x ? 1 : 2;\n    return t[i] * distance(a, b);\n}\n"));
}

TEST(MetricKernels, AParameterIsNoConstantOfTheCompilers) {
    const std::string parameter = "// parameter: gamma = 0.5 in [0, 1] x\n";
    for (const char* body :
         {"return gamma * distance(a, b);", "return (1.0 + vec3(gamma).y) * distance(a, b);",
          "const vec3 s = vec3(gamma, 1.0, gamma); return (s[0] + s.zx.y) * distance(a, b);",
          "const float s[2] = float[](gamma, 1.0); return s[a.x > 1.0 ? 1 : 0];",
          "const mat2 s = mat2(gamma); return s[0][0] * distance(a, b);",
          "return float(double(gamma) + 1.0lf / double(gamma)) * distance(a, b);",
          "return bool(gamma) ? distance(a, b) : float(int(gamma));",
          "float s = pow(2.0, gamma), gamma = s; return gamma * distance(a, b);"}) {
        expect_valid(test::metric_of(parameter + kTransform + kWeight +
                                     "float difference(vec3 a, vec3 b) { " + body + " }\n"));
    }
    const std::string what_to_do = "belongs into the function that uses it";
    expect_refused(
        parameter + "const float k = 1.0 / gamma;\n" + kTransform + kWeight + kDifference,
        {"./my.glsl:2: ", "must be constant", what_to_do});
    expect_refused(parameter + kTransform + kWeight +
                       "float difference(vec3 a, vec3 b) { gamma = 1.0; return 1.0; }\n",
                   {"./my.glsl:4: ", "gamma", "const"});
}

TEST(MetricKernels, ConstantsAreFinite) {
    const std::vector<std::string> words = {"./my.glsl:", "difference()",
                                            "infinite or not a number"};
    for (const char* body :
         {"return min(distance(a, b), 1.0 / 0.0);", "return distance(a, b) + log(-1.0);",
          "return max(sqrt(-1.0), 0.0) + distance(a, b);", "return min(distance(a, b), 1e40);",
          "a *= vec3(1.0, 0.0 / 0.0, 1.0); return a.x;",
          "const float t[2] = float[](1.0, -1.0 / 0.0); return t[a.x > 1.0 ? 1 : 0];"}) {
        expect_difference_refused(body, words);
    }
    expect_refused("// parameter: gamma = 1e300 in [0, 1e300] x\n" + kTransform + kWeight +
                       "float difference(vec3 a, vec3 b) { return min(gamma, distance(a, b)); }\n",
                   {"./my.glsl:4: ", "infinite"});
    expect_valid(
        test::metric_of("// parameter: gamma = 1e300 in [0, 1e300] x\n"
                        "vec3 transform(vec3 f, Voxel v) { return min(min(f, gamma), 1e200); }\n" +
                        kWeight + kDifference));
}

TEST(MetricKernels, VariablesWithoutAValueAreRefused) {
    const std::vector<std::string> words = {"./my.glsl:", "before it has a value"};
    expect_difference_refused("float s;\nreturn s + a.x;", {"./my.glsl:5: ", "difference()"});
    for (const char* body :
         {"float s; if (a.x > 1.0) { s = 1.0; } return s;",
          "float s; for (int i = 0; i < 3; ++i) { s = a[i]; } return s;",
          "float s; while (a.x > s) { s = 2.0; } return 1.0;",
          "float s; switch (int(a.x)) { case 0: s = 1.0; break; case 1: s = 2.0; } return s;",
          "vec3 s; s.x = 1.0; s.z = 1.0; return s.x + s.y;",
          "float s[3]; s[0] = 1.0; s[1] = 1.0; return s[int(a.x)];",
          "float s[3]; s[int(a.x)] = 1.0; return s[0];", "vec3 s; s += a; return s.x;",
          "float s; s += 1.0; return s;",
          "Voxel s; s.theta_h = 1.0; Voxel t = s; return t.theta_h;",
          "mat3 s; s[1] = a; return s[0].x;", "bool s; return s || a.x > 1.0 ? 1.0 : 2.0;"}) {
        expect_difference_refused(body, words);
    }
    expect_difference_refused(
        "float s[3]; for (int i = 0; i < 3; ++i) { s[i] = a[i]; } return s[0];",
        {"./my.glsl:4: ", "before it has a value", "also an array that a loop fills"});
    expect_difference_refused("float s; f(s); return s;", words,
                              "void f(out float x) { if (x > 1.0) { x = 1.0; } }\n");
    expect_difference_refused("float s; f(s, a.x); return s;", words,
                              "void f(out float x, float y) { if (y > 1.0) { x = 1.0; } }\n");
    expect_difference_refused("float s; f(s); return s;", words,
                              "void f(inout float x) { x += 1.0; }\n");
    for (const char* body :
         {"float s; if (a.x > 1.0) { s = 1.0; } else { s = 2.0; } return s;",
          "vec3 s; s.x = 1.0; s.y = a.y; s.z = b.z; return s.x + s.y + s.z;",
          "float s; f(s); return s;", "float s = 1.0; g(s); return s;",
          "float s; do { s = a.x; } while (s > 2.0); return s;",
          "float s[2]; s[0] = 1.0; s[1] = a.x; return s[a.x > 1.0 ? 1 : 0];",
          "float s; switch (int(a.x)) { case 0: s = 1.0; break; default: s = 2.0; } return s;"}) {
        expect_valid(test::metric_of(kTransform + kWeight +
                                     "void f(out float x) { x = 3.0; }\n"
                                     "void g(inout float x) { x += 1.0; }\n"
                                     "float difference(vec3 a, vec3 b) { " +
                                     body + " }\n"));
    }
}

TEST(MetricKernels, EveryPathNeedsAReturn) {
    expect_difference_refused("if (a.x > 1.0) {\nreturn 1.0;\n}", {"difference()", "return"});
    expect_difference_refused("switch (int(a.x)) { case 0: return 1.0; case 1: return 2.0; }",
                              {"difference()", "return"});
    expect_difference_refused("return f(a.x);", {"f()", "return"},
                              "float f(float x) { if (x > 1.0) { return 1.0; } }\n");
    expect_valid(test::metric_of(
        kTransform + kWeight +
        "float difference(vec3 a, vec3 b) {\n"
        "    if (a.x > b.x) { return a.x - b.x; } else { return b.x - a.x; }\n}\n"));
}

TEST(MetricKernels, FunctionsThatTheKernelsUseCannotBeReplaced) {
    expect_refused("bool is_finite(float x) { return true; }\n" + kRest,
                   {"./my.glsl:1: ", "is_finite"});
    expect_refused(
        "float guard_divide(const in float a, const in float b) { return 1.0; }\n" + kRest,
        {"./my.glsl:1: ", "guard_divide"});
    expect_refused("double nan64() { return 0.0; }\n" + kRest, {"./my.glsl:1: ", "nan64"});
    expect_refused("#define float int\n" + kRest, {"./my.glsl:"});
    expect_refused("#define Voxel float\n" + kRest, {"./my.glsl"});
    for (const char* macro :
         {"#undef float", "#define guard_loop() true", "#define kMostLoops 4000000000u",
          "#define GUARDED", "#define main nothing", "#define if while",
          "#define METRIC_FLOAT64"}) {
        expect_valid(test::metric_of(std::string(macro) + "\n" + kRest));
    }
}

TEST(MetricKernels, NestingIsBounded) {
    const auto times = [](int count, const std::string& text) {
        std::string all;
        for (int i = 0; i < count; ++i) {
            all += text;
        }
        return all;
    };
    expect_difference_refused("return " + times(201, "(") + "a.x" + times(201, ")") + ";",
                              {"./my.glsl:4: ", "deeper than 200"});
    expect_difference_refused(times(201, "{") + times(201, "}") + "return a.x;", {"deeper"});
}

}  // namespace
}  // namespace merl::engine
