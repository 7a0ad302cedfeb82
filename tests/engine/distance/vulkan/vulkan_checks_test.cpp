#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <vector>

#include "engine/distance/distances.h"
#include "tests/engine/support.h"

// What is wrong with a user's metric is found wherever it is: at one voxel, between two materials,
// at one number.

namespace merl::engine {
namespace {

using test::FunctionDatabase;

/// Material m is m + 1 everywhere, but at one voxel, where it is 100 times as much.
constexpr std::size_t kMaterials = 25;
constexpr std::uint64_t kOdd = 1234;
double sample(std::size_t material, std::uint64_t voxel, std::size_t) {
    return (1.0 + static_cast<double>(material)) * (voxel == kOdd ? 100 : 1);
}

void compute(const std::string& source) {
    const FunctionDatabase database({.theta_h = 16, .theta_d = 12, .phi_d = 14}, kMaterials,
                                    sample);
    const auto metric = test::metric_of(source);
    const Metric* const one[] = {&metric};
    compute_distances(test::shader_engines(), database, one, {.voxels = VoxelSet::all});
}

const std::string kTransform = "vec3 transform(vec3 f, Voxel v) { return f; }\n";
const std::string kWeight = "float weight(Voxel v) { return 1.0; }\n";

std::string with_degree(const std::string& degree, const std::string& difference) {
    return "// degree: " + degree + "\n" + kTransform + kWeight + "float difference(float d) { " +
           difference + " }\n";
}

std::string of_two(const std::string& difference) {
    return kTransform + kWeight + "float difference(vec3 a, vec3 b) { " + difference + " }\n";
}

TEST(Checks, OfWhatADegreePromises) {
    for (const char* good :
         {"return d * d;", "return pow(abs(d), 2.0);", "return dot(vec2(d, 0.0), vec2(d, 0.0));",
          "float s = 0.0; for (int i = 0; i < 20; ++i) { s += 0.05 * d * d; } return s;"}) {
        EXPECT_NO_THROW(compute(with_degree("2", good))) << good;
    }
    EXPECT_NO_THROW(compute(with_degree("1", "return abs(d);")));
    EXPECT_NO_THROW(compute(with_degree("2/3", "return pow(d * d, 1.0 / 3.0);")));
    // Numbers far from those that occur here, at which results would be others than it says.
    const std::vector<std::pair<std::string, std::string>> bad = {
        {"return d > 1e9 ? d : d * d;", "one way"},
        {"return d < -1e9 ? 0.0 : d * d;", "one way"},
        {"return abs(d) < 1e-9 ? 0.0 : d * d;", "promises |d|^2"},
        {"return abs(d) > 1e10 ? -d * d : d * d;", "expected zero or more"},
        {"return abs(d) > 1e10 ? sqrt(-1.0 - d * d) : d * d;", "nan: expected"},
        {"return d == 0.0 ? 1.0 : d * d;", "difference(0) is 1"},
        {"return d * d * (1.0 + 3e-4);", "promises |d|^2"},
        {"return d * d + (abs(d) > 1e6 ? float(1 << (32 + int(d * 0.0))) : 0.0);", "shifts by"},
        {"for (int i = 0; abs(d) > 1e6; ++i) { d += 0.0; } return d * d;", "does not end"}};
    for (const auto& [text, words] : bad) {
        test::expect_refused([&, &difference = text] { compute(with_degree("2", difference)); },
                             words);
    }
    test::expect_refused([&] { compute(with_degree("1", "return d;")); }, "expected zero or more");
    test::expect_refused([&] { compute(with_degree("2/3", "return abs(d);")); }, "|d|^2/3");
}

/// At a single number, which occurs between two materials.
TEST(Checks, OfANumberThatOccurs) {
    test::expect_refused([&] { compute(with_degree("2", "return d == 100.0 ? 1.0 : d * d;")); },
                         "one way and 1 the other");
}

/// A single voxel of a single material, the last and one in the middle.
TEST(Checks, OfASampleAndAWeight) {
    for (const std::size_t material : {std::size_t{11}, kMaterials - 1}) {
        const auto value = std::to_string(100 * (material + 1));
        const std::string transform = "vec3 transform(vec3 f, Voxel v) { return abs(f - " + value +
                                      ".0).x < 0.5 ? vec3(sqrt(-1.0 - f.x)) : f; }\n";
        const auto named = "\"material-00" + std::to_string(material) + "\" (" + value;
        for (const std::string& difference :
             {std::string("// degree: 2\nfloat difference(float d) { return d * d; }\n"),
              std::string("float difference(vec3 a, vec3 b) { return distance(a, b); }\n")}) {
            const auto header = difference.starts_with("//") ? "// degree: 2\n" : "";
            const auto text =
                header + transform + kWeight + difference.substr(difference.find("float"));
            test::expect_refused([&] { compute(text); }, "transform() of the");
            test::expect_refused([&] { compute(text); }, "at voxel 1234 ");
            test::expect_refused([&] { compute(text); }, named);
        }
    }
    for (const char* weight : {"v.phi_d > 3.0 ? -1.0 : 1.0", "1.0 / (v.phi_d > 3.0 ? 0.0 : 1.0)",
                               "sqrt(v.phi_d > 3.0 ? -1.0 : 1.0)"}) {
        for (const char* degree : {"2", "1", "2/3"}) {
            const std::string power = degree == std::string("2")   ? "d * d"
                                      : degree == std::string("1") ? "abs(d)"
                                                                   : "two_thirds_power(d)";
            test::expect_refused(
                [&] {
                    compute("// degree: " + std::string(degree) + "\n" + kTransform +
                            "float weight(Voxel v) { return " + weight +
                            "; }\nfloat difference(float d) { return " + power + "; }\n");
                },
                "weight() is negative, NaN or infinite");
        }
    }
}

/// Between any two materials, at all voxels or one.
TEST(Checks, OfEveryPair) {
    for (std::size_t i = 0; i + 1 < kMaterials; i += 3) {
        for (std::size_t j = i + 1; j < kMaterials; j += 5) {
            const auto is_pair = [&](std::size_t factor, const char* low, const char* high) {
                return fmt::format("({} == {}.0 && {} == {}.0)", low, factor * (i + 1), high,
                                   factor * (j + 1));
            };
            const auto both = [&](std::size_t factor) {
                return fmt::format("({} || {})", is_pair(factor, "a.x", "b.x"),
                                   is_pair(factor, "b.x", "a.x"));
            };
            test::expect_refused(
                [&] { compute(of_two("return " + both(100) + " ? -2.0 : distance(a, b);")); },
                "at voxel 1234 ");
            test::expect_refused(
                [&] {
                    compute(
                        of_two("return " + both(100) + " ? sqrt(-a.x * b.x) : distance(a, b);"));
                },
                "nan: expected");
            test::expect_refused(
                [&] {
                    compute(of_two("return a.x + b.x > 0.0 && " + both(1) +
                                   " ? 1.0 / (a.y - a.x) : distance(a, b);"));
                },
                "is inf");
            // Not the same the other way round, at all voxels but one.
            test::expect_refused(
                [&] {
                    compute(of_two("return distance(a, b) + (" + is_pair(1, "a.x", "b.x") +
                                   " ? 1.0 : 0.0);"));
                },
                "expected the same");
            test::expect_refused(
                [&] {
                    compute(of_two("return distance(a, b) + (" + is_pair(1, "b.x", "a.x") +
                                   " ? 1.0 : 0.0);"));
                },
                "expected the same");
        }
    }
}

/// What is only at a quarter of the voxels is found where one of any four is looked at.
TEST(Checks, OfSymmetryAtSomeOfTheVoxels) {
    for (int part = 0; part < 4; ++part) {
        const FunctionDatabase database(
            {.theta_h = 16, .theta_d = 12, .phi_d = 14}, 11,
            [&](std::size_t material, std::uint64_t voxel, std::size_t) {
                const bool is_in = voxel / 8 % 4 == static_cast<std::uint64_t>(part);
                return (1.0 + static_cast<double>(material)) * (is_in ? 100 : 1);
            });
        const auto metric = test::metric_of(
            of_two("return distance(a, b) + (a.x == 800.0 && b.x == 1000.0 ? 100.0 : 0.0);"));
        const Metric* const one[] = {&metric};
        test::expect_refused(
            [&] {
                compute_distances(test::shader_engines(), database, one, {.voxels = VoxelSet::all});
            },
            "expected the same");
    }
}

}  // namespace
}  // namespace merl::engine
