#include "engine/database/merl_file.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <fstream>
#include <limits>

#include "engine/base/error.h"
#include "tests/engine/support.h"

namespace merl::engine {
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
    EXPECT_EQ(read_merl_header(path).grid, kGrid);

    const VoxelRange part = {13, 77};
    std::vector<double> got(3 * part.size());
    std::vector<double> expected(3 * part.size());
    read_merl_samples(path, read_merl_header(path), part, got);
    database.read(1, part, expected);
    for (std::size_t i = 0; i < got.size(); ++i) {
        EXPECT_NEAR(got[i] / expected[i], 1, 1e-15);
    }
}

TEST(MerlFile, WhatIsBlackBelowTheHorizonWasNotMeasured) {
    const test::TemporaryDirectory directory;
    const test::FunctionDatabase database(
        kGrid, 1, [](std::size_t, std::uint64_t v, std::size_t) { return v % 2 == 0 ? 0.0 : 1.0; });
    const auto path = directory.path / "m.binary";
    write_merl_file(path, database, 0);
    std::vector<double> got(3 * kGrid.voxels());
    read_merl_samples(path, read_merl_header(path), {0, kGrid.voxels()}, got);
    const Domain domain(kGrid);
    for (std::uint64_t v = 0; v < kGrid.voxels(); ++v) {
        const double expected = v % 2 == 1 ? 1.0 : domain.voxel(v).above_horizon() ? 0.0 : -1.0;
        EXPECT_EQ(got[v] < 0, expected < 0) << v;
        EXPECT_NEAR(std::max(0.0, got[v]), std::max(0.0, expected), 1e-15) << v;
    }
}

TEST(MerlFile, ScalesAreThoseOfTheDatabase) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "m.binary";
    write_bytes(path, header(1, 1, 1) + numbers(3, 3000.0));
    std::vector<double> got(3);
    read_merl_samples(path, read_merl_header(path), {0, 1}, got, {});
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
    for (const double bad : {std::nan(""), inf, -inf, 1e300, 2e16}) {
        std::vector<double> all(24, 1.0);
        all[8 + 5] = bad;  // green; theta_h 1, theta_d 0, phi_d 1
        write_bytes(path,
                    header(2, 2, 2) + std::string(reinterpret_cast<const char*>(all.data()), 192));
        std::vector<double> got(24);
        expect_refused(path, "green of voxel theta_h 1, theta_d 0, phi_d 1 is", [&] {
            read_merl_samples(path, read_merl_header(path), {0, 8}, got, {});
        });
    }
}

TEST(MerlFile, NegativeNumbersOfAnySizeAreNotMeasured) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "m.binary";
    for (const double value : {-1.0, -1e-300, -1e13, -1e308, std::numeric_limits<double>::lowest(),
                               -std::numeric_limits<double>::denorm_min()}) {
        write_bytes(path, header(1, 1, 1) + numbers(3, value));
        std::vector<double> got(3);
        read_merl_samples(path, read_merl_header(path), {0, 1}, got, {});
        EXPECT_LT(got[0], 0) << value;
        EXPECT_TRUE(std::isfinite(got[2])) << value;
    }
}

TEST(MerlFile, AFileOverAllOfPhiDIsToldByItsSizes) {
    const test::TemporaryDirectory directory;
    const auto path = directory.path / "m.binary";
    for (const auto& [theta_h, theta_d, phi_d] :
         {std::array{9, 9, 36}, std::array{3, 5, 20}, std::array{1, 1, 4}}) {
        write_bytes(path, header(theta_h, theta_d, phi_d) +
                              numbers(static_cast<std::size_t>(3 * theta_h * theta_d * phi_d), 1));
        EXPECT_EQ(read_merl_header(path).grid.phi_d_range, PhiDRange::two_pi);
        EXPECT_EQ(read_merl_header(path, PhiDRange::pi).grid.phi_d_range, PhiDRange::pi);
    }
    write_bytes(path, header(9, 9, 35) + numbers(std::size_t{3} * 9 * 9 * 35, 1));
    EXPECT_EQ(read_merl_header(path).grid.phi_d, 35U);
    EXPECT_EQ(read_merl_header(path).grid.phi_d_range, PhiDRange::pi);
    expect_refused(path, "over [0, 2 pi) the number of phi_d is even",
                   [&] { read_merl_header(path, PhiDRange::two_pi); });
}

/// A file that was opened once, and what happens to it before it is opened again.
class OpenedBefore : public ::testing::Test {
  protected:
    OpenedBefore() {
        write_bytes(path, content(1));
        opened = read_merl_header(path);
    }

    static std::string content(double value) { return header(1, 1, 2) + numbers(6, value); }

    void read() const {
        std::vector<double> got(6);
        read_merl_samples(path, opened, {0, 2}, got, {});
    }

    void expect_noticed(const std::string& what) const {
        expect_refused(path, "changed while it was read: " + what, [&] { read(); });
    }

    const test::TemporaryDirectory directory;
    const std::filesystem::path path = directory.path / "m.binary";
    const std::filesystem::path other = directory.path / "other";
    MerlHeader opened;
};

TEST_F(OpenedBefore, TheSameFileIsRead) {
    read();
    std::ifstream(path).get();
    read();
}

TEST_F(OpenedBefore, AnotherFileInItsPlaceIsNoticed) {
    write_bytes(other, content(1));  // even of the same content
    std::filesystem::last_write_time(other, std::filesystem::last_write_time(path));
    std::filesystem::rename(other, path);
    expect_noticed("another file is in its place");
}

TEST_F(OpenedBefore, WritingInPlaceIsNoticed) {
    // At once: the clock of files has not necessarily ticked since the file was opened.
    std::fstream(path, std::ios::binary | std::ios::in | std::ios::out)
        .seekp(12)
        .write("12345678", 8);
    expect_noticed("it was written to");
}

TEST_F(OpenedBefore, WritingInPlaceIsNoticedWhenTheTimeIsSetBack) {
    const auto time = std::filesystem::last_write_time(path);
    std::fstream(path, std::ios::binary | std::ios::in | std::ios::out)
        .seekp(12)
        .write("12345678", 8);
    std::filesystem::last_write_time(path, time);
    expect_noticed("its time of change");
}

TEST_F(OpenedBefore, ATouchedFileIsNoticed) {  // it may be the same, but nothing says so
    std::filesystem::last_write_time(path, std::filesystem::file_time_type::clock::now());
    expect_noticed("it was written to");
}

TEST_F(OpenedBefore, ATruncatedFileIsNoticed) {
    std::filesystem::resize_file(path, 20);
    expect_noticed("it had 60 bytes and has 20");
}

TEST_F(OpenedBefore, ALinkToAnotherFileIsNoticed) {
    const auto link = directory.path / "link.binary";
    write_bytes(other, content(1));
    std::filesystem::create_symlink(path, link);
    const auto linked = read_merl_header(link);
    std::vector<double> got(6);
    read_merl_samples(link, linked, {0, 2}, got, {});
    std::filesystem::remove(link);
    std::filesystem::create_symlink(other, link);
    expect_refused(link, "another file is in its place", [&] {
        read_merl_samples(link, linked, {0, 2}, got, {});
    });
}

TEST_F(OpenedBefore, ARemovedFileIsNoticed) {
    std::filesystem::remove(path);
    expect_refused(path, "cannot be opened", [&] { read(); });
}

TEST_F(OpenedBefore, WritingWhileItIsReadIsNoticed) {
    std::vector<double> got(6);
    expect_refused(path, "changed while it was read: it was written to", [&] {
        read_merl_samples(path, opened, {0, 2}, got, [&](std::size_t plane, auto) {
            if (plane == 1) {
                std::fstream(path, std::ios::binary | std::ios::in | std::ios::out)
                    .seekp(12)
                    .write("12345678", 8);
            }
        });
    });
}

}  // namespace
}  // namespace merl::engine
