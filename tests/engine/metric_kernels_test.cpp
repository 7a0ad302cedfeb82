#include "engine/reflectance/metric_kernels.h"

#include <gtest/gtest.h>

#include <spirv-tools/libspirv.hpp>
#include <string>
#include <vector>

#include "engine/error.h"
#include "engine/reflectance/metric_header.h"
#include "engine/reflectance/metric_words.h"

namespace merl::reflectance {
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

void expect_valid(const Metric& metric) {
    const auto kernels = compile_kernels(metric);
    for (const auto* kernel : {&kernels.weigh, &kernels.prepare, &kernels.norms, &kernels.ranges,
                               &kernels.slopes, &kernels.check}) {
        if (!kernel->empty()) {
            expect_valid(*kernel, metric.name + " beside the difference");
        }
    }
    expect_valid(kernels.difference, metric.name + " difference");
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

/// A metric of these lines, as if it was the file my.glsl.
Metric metric_of(const std::string& source) {
    Metric metric;
    metric.name = "my.glsl";
    metric.file = "./my.glsl";
    metric.source = source;
    metric.header = parse_metric_header(source, metric.file);
    for (const auto& p : metric.header.parameters) {
        metric.parameters.push_back(p.value);
    }
    return metric;
}

const std::string kTransform = "vec3 transform(vec3 f, Voxel v) { return f; }\n";
const std::string kWeight = "float weight(Voxel v) { return 1.0; }\n";
const std::string kDifference = "float difference(vec3 a, vec3 b) { return distance(a, b); }\n";

/// The file is refused with a message that has all these parts.
void expect_refused(const std::string& source, const std::vector<std::string>& parts) {
    try {
        compile_kernels(metric_of(source));
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
    expect_valid(metric_of(kTransform + kWeight + kDifference));
    expect_valid(metric_of("// degree: 1\n" + kTransform + kWeight +
                           "float difference(float d) { return abs(d); }"));
    expect_valid(
        metric_of("// parameter: alpha = 1e-05 in [0, 1] how much\n"
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

TEST(MetricWords, LoopsAreCounted) {
    const auto counted = [](const std::string& text) {
        return with_counted_loops(text, "my.glsl");
    };
    EXPECT_EQ(counted("no loop // for (;;)\n/* while (x) */ fortune"),
              "no loop // for (;;)\n/* while (x) */ fortune");
    EXPECT_EQ(counted("for (int i = 0; i < f(3); ++i) {}"),
              "for (int i = 0;count_loop_() && ( i < f(3)); ++i) {}");
    EXPECT_EQ(counted("for(;;) while (a(b)) do {} while(c\n);"),
              "for(;count_loop_();) while (count_loop_() && (a(b))) do {} while(count_loop_() && "
              "(c\n));");
    EXPECT_EQ(counted("#define L for(;;)"), "#define L for(;count_loop_();)");
    for (const char* text : {"#define L for", "for (;", "for (i)", "while (a; b)", "for (;;;)"}) {
        EXPECT_THROW(counted(text), Error) << text;
    }
}

TEST(MetricKernels, OfAFileWithLoopsAreValid) {
    expect_valid(metric_of(kTransform + kWeight +
                           "float difference(vec3 a, vec3 b) {\n"
                           "    float s = 0.0;\n"
                           "    for (int i = 0; i < 3; ++i) { s += abs(a[i] - b[i]); }\n"
                           "    while (s > 1e9) { s *= 0.5; }\n"
                           "    return s;\n}\n"));
}

TEST(MetricKernels, AFileMayBeCalledLikeOneOfTheFramework) {
    auto metric = metric_of(kTransform + kWeight + kDifference);
    metric.file = "framework/metric.glsl";
    expect_valid(metric);
}

TEST(MetricKernels, TheKernelsAreOutOfReach) {
    const std::string rest = kTransform + kWeight + kDifference;
    expect_refused("layout(binding = 3) buffer B { float b[]; };\n" + rest, {":1: ", "layout"});
    expect_refused("\nshared float x[100];\n" + rest, {":2: ", "shared"});
    expect_refused("float f() { return gl_GlobalInvocationID.x; }\n" + rest, {":1: ", "gl_"});
    expect_refused("/* two\nlines */ #extension GL_NV_x : enable\n" + rest, {":2: ", "#extension"});
    expect_refused("# version 100\n" + rest, {":1: ", "#version"});
    expect_refused("#line 7\n" + rest, {":1: ", "#line"});
    expect_refused("#define L(x, y) x##y\n" + rest, {":1: ", "\"#\""});
    expect_refused("lay\\\nout(binding = 3)\n" + rest, {":1: ", "backslash"});
    expect_valid(metric_of("// layout, gl_x, # and \\ in a comment /* do\n" + rest));
}

}  // namespace
}  // namespace merl::reflectance
