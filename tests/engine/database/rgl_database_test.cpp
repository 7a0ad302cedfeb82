#include "engine/database/rgl_database.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <functional>
#include <limits>
#include <numbers>
#include <utility>

#include "engine/base/error.h"
#include "engine/database/content_hash.h"
#include "engine/database/open_database.h"
#include "engine/database/subset_database.h"
#include "tests/engine/support.h"

namespace merl::engine {
namespace {

using std::numbers::pi;

constexpr Grid kGrid = {.theta_h = 7, .theta_d = 6, .phi_d = 10};

/// A field of a made-up file, and what its header says of it instead of the truth.
struct TestField {
    std::string name;
    std::vector<std::uint64_t> shape;
    std::string bytes;
    std::uint8_t type = 10;
    std::uint64_t offset = 0;  // 0: where it is
};

using Fields = std::vector<TestField>;

template <typename Value>
std::string bytes_of(Value value) {
    return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

TestField floats(std::string name, std::vector<std::uint64_t> shape,
                 const std::vector<float>& values) {
    return {std::move(name),
            std::move(shape),
            {reinterpret_cast<const char*>(values.data()), values.size() * sizeof(float)}};
}

/// The bytes of a file of these fields.
std::string file_of(const Fields& fields) {
    std::string header = std::string("tensor_file\0\1\0", 14);
    header += bytes_of(static_cast<std::uint32_t>(fields.size()));
    std::size_t end = header.size();
    for (const auto& field : fields) {
        end += 13 + field.name.size() + 8 * field.shape.size();
    }
    std::string data;
    for (const auto& field : fields) {
        header += bytes_of(static_cast<std::uint16_t>(field.name.size())) + field.name;
        header += bytes_of(static_cast<std::uint16_t>(field.shape.size())) + bytes_of(field.type);
        header += bytes_of(field.offset != 0 ? field.offset : end + data.size());
        for (const auto size : field.shape) {
            header += bytes_of(size);
        }
        data += field.bytes;
    }
    return header + data;
}

void write_file(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

/// Numbers at the nodes of maps over [0, 1]², one after the other.
std::vector<float> maps(std::size_t count, std::size_t height, std::size_t width,
                        const std::function<double(std::size_t, double, double)>& value) {
    std::vector<float> values;
    for (std::size_t i = 0; i < count * height * width; ++i) {
        const double x = static_cast<double>(i % width) / static_cast<double>(width - 1);
        const double y = static_cast<double>(i / width % height) / static_cast<double>(height - 1);
        values.push_back(static_cast<float>(value(i / width / height, x, y)));
    }
    return values;
}

/// A material whose every part has a formula that is bilinear, so that results have one too. With
/// two phi_i and three theta_i; sizes are odd, and such that the nodes are exact in float32.
Fields made_up() {
    return {
        floats("phi_i", {2}, {-1, 2}),
        floats("theta_i", {3}, {0, 0.5, 1.5}),
        floats("sigma", {3, 5}, maps(1, 3, 5, [](auto, double x, double y) { return 1 + x * y; })),
        floats("ndf", {5, 3}, maps(1, 5, 3, [](auto, double x, double y) { return x + 2 * y; })),
        floats("vndf", {2, 3, 5, 9},
               maps(6, 5, 9,
                    [](std::size_t slice, double x, double y) {
                        const double scale = std::ldexp(1, static_cast<int>(slice) - 3);
                        return scale * (slice == 0   ? 1
                                        : slice == 1 ? x * y
                                        : slice == 2 ? 1 - y
                                        : slice == 3 ? x
                                        : slice == 4 ? 1 - x
                                                     : y);
                    })),
        floats("rgb", {2, 3, 3, 3, 5},
               maps(18, 3, 5,
                    [](std::size_t map, double x, double y) {
                        const std::size_t slice = map / 3 + 1;
                        return map % 3 == 0   ? static_cast<double>(slice) * x
                               : map % 3 == 1 ? y + x * y / 4
                                              : x - static_cast<double>(slice) / 4;
                    })),
        {"description", {7}, "made up", 1},
        {"jacobian", {1}, "\1", 1},
    };
}

/// f·cos θ_o of made_up() by its formulas.
std::array<double, 3> made_up_value(double theta_i, double phi_i, double theta_m) {
    const double x = std::sqrt(2 * theta_m / pi);
    const double y = std::fmod(1.5 - phi_i / (2 * pi), 1);
    const double p = std::clamp((phi_i + 1) / 3, 0.0, 1.0);
    const double t = std::clamp(theta_i < 0.5 ? theta_i / 0.5 : theta_i + 0.5, 0.0, 2.0);
    std::array<double, 6> weights = {};
    for (std::size_t slice = 0; slice < 6; ++slice) {
        weights[slice] = (slice < 3 ? 1 - p : p) *
                         std::max(0.0, 1 - std::abs(t - static_cast<double>(slice % 3)));
    }
    // Of each slice's density, of mass 1: ∫₀ʸ∫₀¹, ∫₀ˣ at y, ∫₀¹ at y.
    const std::array<std::array<double, 3>, 6> integrals = {{
        {y, x, 1},
        {y * y, 2 * x * x * y, 2 * y},
        {2 * y - y * y, 2 * x * (1 - y), 2 * (1 - y)},
        {y, x * x, 1},
        {y, 2 * x - x * x, 1},
        {y * y, 2 * x * y, 2 * y},
    }};
    std::array<double, 3> sums = {};
    for (std::size_t slice = 0; slice < 6; ++slice) {
        for (std::size_t i = 0; i < 3; ++i) {
            sums[i] += weights[slice] * integrals[slice][i];
        }
    }
    const double s_y = sums[0];
    const double s_x = sums[1] / sums[2];
    std::array<double, 3> rgb = {0, s_y + s_x * s_y / 4, s_x};
    for (std::size_t slice = 0; slice < 6; ++slice) {
        rgb[0] += weights[slice] * static_cast<double>(slice + 1) * s_x;
        rgb[2] -= weights[slice] * static_cast<double>(slice + 1) / 4;
    }
    const double sigma = 1 + std::sqrt(2 * theta_i / pi) * (phi_i / (2 * pi) + 0.5);
    for (auto& value : rgb) {
        value = std::max(0.0, value) * (x + 2 * y) / (4 * sigma);
    }
    return rgb;
}

TEST(RglDatabase, IsTheFormulaOfTheSpecification) {
    const test::TemporaryDirectory directory;
    write_file(directory.path / "m.bsdf", file_of(made_up()));
    const auto database = open_rgl_file(directory.path / "m.bsdf", kGrid);
    std::vector<double> samples(3 * kGrid.voxels());
    database->read(0, {0, kGrid.voxels()}, samples);
    const Domain domain(kGrid);
    std::size_t dark = 0;
    for (std::uint64_t i = 0; i < kGrid.voxels(); ++i) {
        const Voxel v = domain.voxel(i);
        // The half vector and the difference, then both directions, turned so that phi_h = 0.
        const double hx = std::sin(v.theta_h);
        const double hz = std::cos(v.theta_h);
        const double dx = std::sin(v.theta_d) * std::cos(v.phi_d);
        const double dy = std::sin(v.theta_d) * std::sin(v.phi_d);
        const double dz = std::cos(v.theta_d);
        const double iz = hz * dz - hx * dx;
        const double oz = hz * dz + hx * dx;
        const auto forth =
            made_up_value(std::acos(iz), std::atan2(dy, hx * dz + hz * dx), v.theta_h);
        const auto back =
            made_up_value(std::acos(oz), std::atan2(-dy, hx * dz - hz * dx), v.theta_h);
        for (std::size_t c = 0; c < 3; ++c) {
            const double expected =
                iz > 0 && oz > 0 ? (forth[c] * oz + back[c] * iz) / (oz * oz + iz * iz) : 0;
            const double found = samples[c * kGrid.voxels() + i];
            EXPECT_NEAR(found, expected, 1e-12 * std::max(1.0, expected)) << i << ' ' << c;
            dark += iz > 0 && oz > 0 && found == 0 ? 1 : 0;
        }
    }
    EXPECT_GT(dark, 10U);  // blue is negative somewhere, and counts as zero
}

TEST(RglDatabase, OneAngleIsEnoughAndARowWithoutMassIsAtItsBegin) {
    Fields fields = made_up();
    fields[0] = floats("phi_i", {1}, {0});
    fields[1] = floats("theta_i", {1}, {0.3F});
    // All mass is at x = y = 1, where no direction of the grid is: x' = y' = 0.
    fields[4] = floats("vndf", {1, 1, 100, 100}, maps(1, 100, 100, [](auto, double x, double y) {
                           return x == 1 && y == 1 ? 1e-40 : 0;
                       }));
    fields[5] = floats("rgb", {1, 1, 3, 2, 2}, {2, 9, 9, 9, 4, 9, 9, 9, 6, 9, 9, 9});
    const test::TemporaryDirectory directory;
    write_file(directory.path / "m.bsdf", file_of(fields));
    const auto database = open_rgl_file(directory.path / "m.bsdf", kGrid);
    std::vector<double> samples(3 * kGrid.voxels());
    database->read(0, {0, kGrid.voxels()}, samples);
    EXPECT_GT(samples[0], 0);
    for (std::uint64_t i = 0; i < kGrid.voxels(); ++i) {
        EXPECT_NEAR(samples[kGrid.voxels() + i], 2 * samples[i], 1e-12 * samples[i]);
        EXPECT_NEAR(samples[2 * kGrid.voxels() + i], 3 * samples[i], 1e-12 * samples[i]);
    }
}

/// Why a file cannot be used.
std::string refusal(const std::filesystem::path& path) {
    try {
        const auto database = open_rgl_file(path, kGrid);
        std::vector<double> samples(3 * kGrid.voxels());
        database->read(0, {0, kGrid.voxels()}, samples);
    } catch (const InputError& error) {
        const std::string what = error.what();
        EXPECT_EQ(what.find(path.string() + ": "), 0U) << what;
        return what.substr(path.string().size());
    }
    return "it can be used";
}

void expect_refused(const std::string& bytes, const std::string& words) {
    const test::TemporaryDirectory directory;
    write_file(directory.path / "bad.bsdf", bytes);
    const auto what = refusal(directory.path / "bad.bsdf");
    EXPECT_NE(what.find(words), std::string::npos) << what << "\nexpected: " << words;
}

TEST(RglDatabase, OtherFormatsAreNamed) {
    expect_refused("", "has 0 bytes; expected a file of the RGL");
    expect_refused("tensor_file", "has 11 bytes");
    expect_refused("Source  Measured\r\nSymmetry  PlaneSymmetrical\r\n", "Zemax and LightTools");
    expect_refused("\x1f\x8b\x08 is what gzip makes", "begins with the bytes 1f 8b 08");
    auto bytes = file_of(made_up());
    bytes[12] = 2;
    expect_refused(bytes, "is of version 2.0; expected 1.0");
    auto fields = made_up();
    fields[5].name = "spectra";
    expect_refused(file_of(fields), "is spectral");
    fields = made_up();
    fields[0] = floats("phi_i", {3}, {0, 1, 2});
    expect_refused(file_of(fields), "is anisotropic (phi_i has 3 angles)");
}

TEST(RglDatabase, HostileHeadersAreRefused) {
    const auto whole = file_of(made_up());
    const test::TemporaryDirectory directory;
    // All are written first: opening a file that is quite new takes some milliseconds.
    for (std::size_t size = 0; size <= whole.size(); ++size) {
        write_file(directory.path / std::to_string(size), whole.substr(0, size));
    }
    for (std::size_t size = 0; size < whole.size(); ++size) {
        EXPECT_NE(refusal(directory.path / std::to_string(size)), "it can be used") << size;
    }
    EXPECT_EQ(refusal(directory.path / std::to_string(whole.size())), "it can be used");
    constexpr std::uint64_t kMost = std::numeric_limits<std::uint64_t>::max();
    auto bytes = whole;
    std::memset(bytes.data() + 14, 0xff, 4);
    expect_refused(bytes, "has 4294967295 fields; expected at most 1024");
    bytes = whole;
    std::memset(bytes.data() + 18, 0xff, 2);
    expect_refused(bytes, "the name of field 0 has 65535 bytes; expected at most 256");
    bytes = whole;
    std::memset(bytes.data() + 25, 0xff, 2);
    expect_refused(bytes, "the field phi_i has 65535 dimensions; expected at most 16");
    for (const auto type : std::to_array<std::uint8_t>({0, 12, 255})) {
        auto fields = made_up();
        fields[6].type = type;
        expect_refused(file_of(fields), "the field description is of type");
    }
    const auto with = [](std::size_t field, const auto& change) {
        auto fields = made_up();
        change(fields[field]);
        return file_of(fields);
    };
    // What products or sums of these would be, modulo 2^64, is in the file.
    for (const std::vector<std::uint64_t>& shape : {std::vector<std::uint64_t>{2, kMost, 5, 9},
                                                    {1ULL << 62U, 4, 1, 1},
                                                    {1ULL << 32U, 1ULL << 32U, 5, 9},
                                                    {kMost, kMost, kMost, kMost},
                                                    {2, 3, 5, 1'000'000}}) {
        expect_refused(with(4, [&](TestField& field) { field.shape = shape; }), "ends after the");
    }
    for (const std::uint64_t offset : {kMost, kMost - 1000, std::uint64_t{1'000'000}}) {
        expect_refused(with(4, [&](TestField& field) { field.offset = offset; }),
                       "truncated or damaged");
        expect_refused(with(6, [&](TestField& field) { field.offset = offset; }),
                       "truncated or damaged");
    }
    expect_refused(with(4, [](TestField& field) { field.offset = 20; }),
                   "where the header ends; expected fields that do not overlap");
    expect_refused(with(2, [&](TestField& field) { field.offset = whole.size() - 70; }),
                   "do not overlap");
    expect_refused(with(6, [](TestField& field) { field.name = "ndf"; }), "has two fields ndf");
}

TEST(RglDatabase, WrongFieldsAreRefused) {
    const auto with = [](std::size_t place, const TestField& field) {
        auto fields = made_up();
        fields[place] = field;
        return file_of(fields);
    };
    for (std::size_t i = 0; i < 6; ++i) {
        auto fields = made_up();
        const auto name = std::exchange(fields[i].name, "other");
        expect_refused(file_of(fields), fmt::format("has no field {}; expected phi_i", name));
        fields[i].name = name;
        fields[i].type = 6;
        expect_refused(file_of(fields), "of type 6 and");
        fields[i].type = 10;
        fields[i].shape.push_back(1);
        expect_refused(file_of(fields), "dimensions; expected type 10 (float32) and");
        fields[i].shape.pop_back();
        // Each number in turn, of those that begin an array and one in its middle.
        for (const float value : {std::nanf(""), HUGE_VALF, -HUGE_VALF}) {
            for (const std::size_t at : {std::size_t{0}, fields[i].bytes.size() / 8}) {
                auto bad = fields;
                std::memcpy(bad[i].bytes.data() + 4 * at, &value, sizeof(value));
                expect_refused(file_of(bad), fmt::format("number {} of the field {} [", at, name));
                expect_refused(file_of(bad), "expected a finite number");
            }
        }
    }
    for (const std::size_t i : {2U, 3U, 4U}) {
        auto fields = made_up();
        std::memcpy(fields[i].bytes.data(), "\0\0\x80\xbf", 4);  // -1
        expect_refused(file_of(fields), "is -1; expected a finite number, zero or more");
    }
    expect_refused(with(0, floats("phi_i", {0}, {})), "phi_i [0]");
    expect_refused(with(1, floats("theta_i", {0}, {})), "is empty; expected at least one angle");
    expect_refused(with(1, floats("theta_i", {3}, {0, 1.5, 0.5})), "has 0.5 after 1.5");
    expect_refused(with(1, floats("theta_i", {3}, {0, 0.5, 0.5})), "has 0.5 after 0.5");
    expect_refused(with(1, floats("theta_i", {3}, {0, 40, 80})),
                   "has 80; expected radians from 0.0000 to 1.5708");
    expect_refused(with(1, floats("theta_i", {3}, {-1, 0, 1})), "has -1; expected radians");
    expect_refused(with(0, floats("phi_i", {2}, {-180, 180})), "has -180; expected radians");
    expect_refused(with(1, floats("theta_i", {2}, {0, 1})), "expected: [2, 2, y, x]");
    expect_refused(with(0, floats("phi_i", {1}, {0})), "expected: [1, 3, y, x]");
    expect_refused(with(2, floats("sigma", {1, 5}, std::vector<float>(5))), "expected: [y, x]");
    expect_refused(with(3, floats("ndf", {0, 9}, {})), "with y and x at least 2");
    expect_refused(with(5, floats("rgb", {2, 3, 4, 3, 5}, std::vector<float>(360))),
                   "expected: [2, 3, 3, y, x]");
    auto fields = made_up();
    fields[4].bytes.replace(720, 180, 180, '\0');  // the fifth slice
    expect_refused(file_of(fields), "at phi_i 2 and theta_i 0.5 (slice 1, 1) is zero everywhere");
    expect_refused(with(2, floats("sigma", {2, 2}, std::vector<float>(4))),
                   "/sr; expected a finite");
    expect_refused(with(5, floats("rgb", {2, 3, 3, 2, 2}, std::vector<float>(72, 3e38F))),
                   "expected a finite number, at most 1000000000000; its rgb, ndf or sigma");
}

std::string hash_of(const Fields& fields) {
    const test::TemporaryDirectory directory;
    write_file(directory.path / "m.bsdf", file_of(fields));
    return content_hash_of(*open_rgl_file(directory.path / "m.bsdf", kGrid), [](double) {});
}

TEST(RglDatabase, TheHashIsThatOfTheFieldsThatCount) {
    const auto whole = hash_of(made_up());
    auto fields = made_up();
    fields[6].bytes = "changed";
    std::swap(fields[0], fields[7]);
    fields.push_back({"unknown", {2, 1}, "abcdefgh", 9});
    fields.back().shape = {2, 2};
    EXPECT_EQ(hash_of(fields), whole);
    for (std::size_t i = 0; i < 6; ++i) {
        fields = made_up();
        fields[i].bytes[fields[i].bytes.size() - 4] ^= 1;
        EXPECT_NE(hash_of(fields), whole) << fields[i].name;
    }
    fields = made_up();
    fields[2].shape = {5, 3};
    EXPECT_NE(hash_of(fields), whole);
}

TEST(RglDatabase, IsADirectoryWithoutMerlFiles) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path;
    write_file(path / "b.bsdf", file_of(made_up()));
    EXPECT_TRUE(is_rgl(path));
    EXPECT_TRUE(is_rgl(path / "b.bsdf"));
    EXPECT_EQ(open_database(path)->materials().size(), 1U);
    write_file(path / "a.BSDF", "no material");
    EXPECT_THROW(open_database(path), InputError);
    const auto listing = list_database(path);
    ASSERT_EQ(listing.materials.size(), 2U);
    EXPECT_THROW(listing.materials[0].open(), InputError);
    EXPECT_EQ(listing.materials[1].open()->kind(), "RGL file");
    EXPECT_EQ(list_database(path / "b.bsdf").materials.size(), 1U);
    EXPECT_THROW(open_database(path / "b.bsdf"), InputError);
    write_file(path / "a.BSDF", file_of(made_up()));
    const auto database = open_database(path);
    EXPECT_EQ(database->kind(), "RGL directory");
    EXPECT_EQ(database->grid(), Grid());
    EXPECT_EQ(database->path(), path);
    EXPECT_EQ(database->materials(), (std::vector<std::string>{"a", "b"}));
    write_file(path / "c.binary", "");
    EXPECT_FALSE(is_rgl(path));
    EXPECT_FALSE(is_rgl(path / "none"));
}

TEST(RglDatabase, WhatItKeepsChangesNoBit) {
    const test::TemporaryDirectory directory;
    write_file(directory.path / "a.bsdf", file_of(made_up()));
    write_file(directory.path / "b.bsdf", file_of(made_up()));
    constexpr Grid grid = {.theta_h = 40, .theta_d = 30, .phi_d = 35};
    const std::uint64_t bytes = 24 * grid.voxels();
    EXPECT_EQ(make_subset(open_rgl_directory(directory.path, {.grid = grid}), {1})->keep(7), 7U);
    std::vector<double> expected(3 * grid.voxels());
    open_rgl_directory(directory.path, {.grid = grid})->read(1, {0, grid.voxels()}, expected);
    for (const std::uint64_t most : {std::uint64_t{0}, bytes / 2, bytes, 9 * bytes}) {
        const auto database = open_rgl_directory(directory.path, {.grid = grid});
        EXPECT_EQ(database->keep(most), std::min(most, 2 * bytes));
        EXPECT_EQ(database->keep(most / 2), std::min(most, 2 * bytes));
        for (const std::uint64_t step :
             {grid.voxels(), std::uint64_t{10'007}, std::uint64_t{17'000}}) {
            for (std::uint64_t last = grid.voxels(); last > 0; last -= std::min(last, step)) {
                const VoxelRange range = {last - std::min(last, step), last};
                std::vector<double> samples(3 * range.size());
                database->read(1, range, samples);
                for (std::size_t plane = 0; plane < 3; ++plane) {
                    ASSERT_TRUE(std::equal(
                        samples.begin() + static_cast<std::ptrdiff_t>(plane * range.size()),
                        samples.begin() + static_cast<std::ptrdiff_t>((plane + 1) * range.size()),
                        expected.begin() +
                            static_cast<std::ptrdiff_t>(plane * grid.voxels() + range.first)))
                        << most << ' ' << step;
                }
            }
        }
    }
}

}  // namespace
}  // namespace merl::engine
