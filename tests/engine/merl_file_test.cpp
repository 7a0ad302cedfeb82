#include "engine/reflectance/merl_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <limits>

#include "engine/error.h"
#include "tests/engine/support.h"

namespace merl::reflectance {
namespace {

constexpr Grid kGrid = {.theta_h = 6, .theta_d = 5, .phi_d = 4};

void write_bytes(const std::filesystem::path& path, const std::string& bytes) {
    std::ofstream(path, std::ios::binary) << bytes;
}

std::string header(std::int32_t a, std::int32_t b, std::int32_t c) {
    const std::int32_t sizes[] = {a, b, c};
    return {reinterpret_cast<const char*>(sizes), sizeof(sizes)};
}

std::string numbers(std::size_t count, double value) {
    const std::vector<double> all(count, value);
    return {reinterpret_cast<const char*>(all.data()), count * sizeof(double)};
}

/// Expects that `read` throws an input error whose message names the file and holds `part`.
template <typename Read>
void expect_refused(const std::filesystem::path& path, const std::string& part, const Read& read) {
    try {
        read();
        FAIL() << "expected a refusal with: " << part;
    } catch (const Error& error) {
        EXPECT_EQ(error.fault(), Fault::input);
        EXPECT_EQ(std::string(error.what()).find(path.string()), 0U) << error.what();
        EXPECT_NE(std::string(error.what()).find(part), std::string::npos) << error.what();
    }
}

TEST(MerlFile, WhatIsWrittenIsRead) {
    const test::TemporaryDirectory directory;
    const test::FunctionDatabase database(
        kGrid, 3, [](std::size_t m, std::uint64_t v, std::size_t c) {
            return 0.001 + static_cast<double>(100 * m + 10 * v + c);
        });
    const auto path = directory.path / "m.binary";
    write_merl_file(path, database, 1);
    EXPECT_EQ(std::filesystem::file_size(path), 12 + kGrid.voxels() * 24);
    EXPECT_EQ(read_merl_header(path), kGrid);

    const Domain domain(kGrid);
    const VoxelRange part = {13, 77};
    std::vector<double> got(3 * part.size());
    std::vector<double> expected(3 * part.size());
    read_merl_samples(path, kGrid, part, got, {});
    database.read(1, part, expected, nullptr);
    for (std::uint64_t i = 0; i < part.size(); ++i) {
        for (std::size_t plane = 0; plane < 3; ++plane) {
            const double value = got[plane * part.size() + i];
            if (domain.voxel(part.first + i).above_horizon()) {
                EXPECT_NEAR(value / expected[plane * part.size() + i], 1, 1e-15);
            } else {
                EXPECT_LT(value, 0);
            }
        }
    }
}

TEST(MerlFile, ScalesAreThoseOfTheDatabase) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "m.binary";
    write_bytes(path, header(1, 1, 1) + numbers(3, 3000.0));
    std::vector<double> got(3);
    read_merl_samples(path, {.theta_h = 1, .theta_d = 1, .phi_d = 1}, {0, 1}, got, {});
    EXPECT_DOUBLE_EQ(got[0], 2.0);
    EXPECT_DOUBLE_EQ(got[1], 2.3);
    EXPECT_DOUBLE_EQ(got[2], 3.32);
}

TEST(MerlFile, BadFilesAreRefused) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "bad.binary";
    const auto refused = [&](const std::string& bytes, const std::string& part) {
        write_bytes(path, bytes);
        expect_refused(path, part, [&] { read_merl_header(path); });
    };
    expect_refused(path, "cannot be opened", [&] { read_merl_header(path); });
    refused("", "has 0 bytes");
    refused("elevenbytes", "has 11 bytes");
    refused(header(0, 90, 180), "0 x 90 x 180");
    refused(header(90, -90, 180), "90 x -90 x 180");
    refused(header(2147483647, 2147483647, 2147483647), "at most");
    refused(header(65536, 65536, 1), "at most");  // 2^32 voxels
    refused(header(2, 2, 2) + numbers(23, 1), "truncated");
    refused(header(2, 2, 2) + numbers(25, 1), "over-long");
    refused(header(2, 2, 2) + numbers(24, 1) + "x", "over-long");
    expect_refused(directory.path, "not a regular file", [&] { read_merl_header(directory.path); });
}

TEST(MerlFile, NumbersThatAreNoneAreRefusedWithTheirVoxel) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "bad.binary";
    const double inf = std::numeric_limits<double>::infinity();
    for (const double bad : {std::nan(""), inf, -inf, 1e300, -1e300}) {
        std::vector<double> all(24, 1.0);
        all[8 + 5] = bad;  // green; theta_h 1, theta_d 0, phi_d 1
        write_bytes(path,
                    header(2, 2, 2) + std::string(reinterpret_cast<const char*>(all.data()), 192));
        std::vector<double> got(24);
        expect_refused(path, "green of voxel theta_h 1, theta_d 0, phi_d 1 is", [&] {
            read_merl_samples(path, {.theta_h = 2, .theta_d = 2, .phi_d = 2}, {0, 8}, got, {});
        });
    }
}

TEST(MerlFile, AFileThatChangesWhileItIsReadIsRefused) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "m.binary";
    write_bytes(path, header(1, 1, 2) + numbers(6, 1));
    std::vector<double> got(3);
    expect_refused(path, "changed while it was read", [&] {
        read_merl_samples(path, {.theta_h = 1, .theta_d = 2, .phi_d = 1}, {0, 1}, got, {});
    });
}

}  // namespace
}  // namespace merl::reflectance
