#include "scan/select/scan_tables.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <limits>
#include <memory>
#include <system_error>
#include <thread>

#include "scan/select/disagreements.h"
#include "tests/scan/support.h"

namespace merl::scan {
namespace {

using testing::make_distances;
using testing::random_cases;

/// What `write` writes to a file.
std::string written(const std::function<void(int)>& write) {
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::tmpfile(), std::fclose);
    const int descriptor = ::fileno(file.get());
    write(descriptor);
    std::string text(static_cast<std::size_t>(::lseek(descriptor, 0, SEEK_END)), '\0');
    EXPECT_EQ(::pread(descriptor, text.data(), text.size(), 0), static_cast<ssize_t>(text.size()));
    return text;
}

std::string pairs_text(const Distances& distances) {
    return written([&](int file) { write_pairs(file, distances); });
}

std::string disagreements_text(const Distances& distances,
                               const std::vector<Configuration>& configurations) {
    return written([&](int file) { write_disagreements(file, distances, configurations); });
}

using Record = std::vector<std::string>;

/// Reads CSV as RFC 4180 says.
std::vector<Record> parse(const std::string& text) {
    std::vector<Record> records;
    Record record(1);
    bool quoted = false;
    for (std::size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quoted && c == '"' && i + 1 < text.size() && text[i + 1] == '"') {
            record.back() += text[++i];
        } else if (c == '"') {
            quoted = !quoted;
        } else if (!quoted && c == ',') {
            record.emplace_back();
        } else if (!quoted && c == '\n') {
            records.push_back(std::move(record));
            record.assign(1, "");
        } else {
            record.back() += c;
        }
    }
    EXPECT_EQ(record, Record(1)) << "text after the last line end";
    return records;
}

TEST(Tables, PairsInPairOrder) {
    EXPECT_EQ(pairs_text(make_distances({1, 0.1, 3e-10}, {0, 2.5, 1e300})),
              "material_1,material_2,one,two\n"
              "m00000,m00001,1,0\n"
              "m00000,m00002,0.1,2.5\n"
              "m00001,m00002,3e-10,1e+300\n");
}

TEST(Tables, PairsWithTheirBounds) {
    Distances distances = make_distances({1, 0.1, 3e-10}, {0, 2.5, 1e300});
    distances.second_metric = "t,wo";
    distances.first_bounds = {1e-7, 0, 0};
    distances.second_bounds = {5e-324, std::numeric_limits<double>::infinity(), 0};
    EXPECT_EQ(pairs_text(distances),
              "material_1,material_2,one,\"t,wo\",one_bound,\"t,wo_bound\",one_precision,"
              "\"t,wo_precision\"\n"
              "m00000,m00001,1,0,1e-07,5e-324,float32,float32\n"
              "m00000,m00002,0.1,2.5,0,inf,float64,float32\n"
              "m00001,m00002,3e-10,1e+300,0,0,float64,float64\n");
}

TEST(Tables, DisagreementsAndSelection) {
    const Distances distances = make_distances({1, 2, 4}, {4, 2, 1});
    const std::vector<Configuration> list = all_disagreements(distances);
    EXPECT_EQ(disagreements_text(distances, list),
              "left_1,left_2,right_1,right_2,one_left,one_right,two_left,two_right,agreement\n"
              "m00000,m00001,m00001,m00002,1,4,4,1,0.0625\n"
              "m00000,m00001,m00000,m00002,1,2,4,2,0.25\n"
              "m00000,m00002,m00001,m00002,2,4,2,1,0.25\n");
    EXPECT_EQ(written([&](int file) { write_selection(file, distances, list); }),
              "rank,left_1,left_2,right_1,right_2,one_left,one_right,two_left,two_right,agreement\n"
              "1,m00000,m00001,m00001,m00002,1,4,4,1,0.0625\n"
              "2,m00000,m00001,m00000,m00002,1,2,4,2,0.25\n"
              "3,m00000,m00002,m00001,m00002,2,4,2,1,0.25\n");
}

TEST(Tables, NothingToTellIsOnlyAHeader) {
    const Distances distances = make_distances({1}, {2});
    const std::string header =
        "left_1,left_2,right_1,right_2,one_left,one_right,two_left,two_right,agreement\n";
    EXPECT_EQ(disagreements_text(distances, {}), header);
    EXPECT_EQ(written([&](int file) { write_selection(file, distances, {}); }), "rank," + header);
}

TEST(Tables, HostileNamesReadBack) {
    Distances distances = make_distances({1, 2, 4}, {4, 2, 1});
    distances.names = {"\"", "=cmd|' /C calc'!A0,\r\n", "two\nlines, \"quoted\""};
    distances.first_metric = "a,b";
    const auto pairs = parse(pairs_text(distances));
    ASSERT_EQ(pairs.size(), 4U);
    EXPECT_EQ(pairs[0], (Record{"material_1", "material_2", "a,b", "two"}));
    EXPECT_EQ(pairs[1], (Record{distances.names[0], distances.names[1], "1", "4"}));
    EXPECT_EQ(pairs[3], (Record{distances.names[1], distances.names[2], "4", "1"}));

    const auto rows = parse(disagreements_text(distances, all_disagreements(distances)));
    ASSERT_EQ(rows.size(), 4U);
    EXPECT_EQ(rows[0][4], "a,b_left");
    EXPECT_EQ(rows[1], (Record{distances.names[0], distances.names[1], distances.names[1],
                               distances.names[2], "1", "4", "4", "1", "0.0625"}));
}

TEST(Tables, EveryRowReadsBackInOrder) {
    // Many chunks, and distances from the smallest to the largest.
    for (const auto& random_case : random_cases()) {
        SCOPED_TRACE(random_case.name);
        const Distances distances = random_case.make(20, 8);
        const std::vector<Configuration> list = all_disagreements(distances);
        const auto rows = parse(disagreements_text(distances, list));
        ASSERT_EQ(rows.size(), list.size() + 1);
        for (std::size_t i = 0; i < list.size(); ++i) {
            const auto [left, right, value] = list[i];
            const Record& row = rows[i + 1];
            ASSERT_EQ(row.size(), 9U);
            const Pair left_pair = pair_at(left, 20);
            const Pair right_pair = pair_at(right, 20);
            ASSERT_EQ(row[0], distances.names[left_pair.first]);
            ASSERT_EQ(row[1], distances.names[left_pair.second]);
            ASSERT_EQ(row[2], distances.names[right_pair.first]);
            ASSERT_EQ(row[3], distances.names[right_pair.second]);
            const std::array expected{distances.first[left], distances.first[right],
                                      distances.second[left], distances.second[right], value};
            for (std::size_t column = 0; column < expected.size(); ++column) {
                ASSERT_EQ(std::strtod(row[4 + column].c_str(), nullptr), expected[column]);
            }
        }
    }
}

TEST(Tables, BytesDoNotDependOnThreads) {
    const Distances distances = random_cases()[1].make(24, 9);
    const std::vector<Configuration> list = all_disagreements(distances);
    ASSERT_GT(list.size(), 20'000U);
    const std::string expected = disagreements_text(distances, list);
    for (const int threads : {1, 2, 5}) {
        testing::with_threads(
            threads, [&] { EXPECT_TRUE(disagreements_text(distances, list) == expected); });
    }
}

TEST(Tables, APipeTakesShortWrites) {
    const Distances distances = random_cases()[0].make(24, 10);
    const std::vector<Configuration> list = all_disagreements(distances);
    const std::string expected = disagreements_text(distances, list);
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe(ends.data()), 0);
    std::string received;
    std::thread reader([&] {
        std::array<char, 1000> buffer;
        ssize_t count = 0;
        while ((count = ::read(ends[0], buffer.data(), buffer.size())) > 0) {
            received.append(buffer.data(), static_cast<std::size_t>(count));
        }
    });
    write_disagreements(ends[1], distances, list);
    ::close(ends[1]);
    reader.join();
    ::close(ends[0]);
    EXPECT_TRUE(received == expected);
}

TEST(Tables, ProgressRisesToOne) {
    const Distances distances = random_cases()[0].make(24, 13);
    const std::vector<Configuration> list = all_disagreements(distances);
    ASSERT_GT(list.size(), 10'000U);
    for (const int threads : {1, 2, 5}) {
        std::vector<double> shares;
        testing::with_threads(threads, [&] {
            written([&](int file) {
                write_disagreements(file, distances, list,
                                    [&](double share) { shares.push_back(share); });
            });
        });
        ASSERT_GE(shares.size(), 4U);
        EXPECT_GT(shares.front(), 0);
        EXPECT_EQ(shares.back(), 1);
        EXPECT_TRUE(std::ranges::is_sorted(shares, std::less_equal<>()));
    }
}

TEST(Tables, WhatProgressThrowsEndsTheWriting) {
    struct Enough {};
    const Distances distances = random_cases()[0].make(24, 13);
    const std::vector<Configuration> list = all_disagreements(distances);
    const std::size_t whole = disagreements_text(distances, list).size();
    for (const int threads : {1, 2, 5}) {
        testing::with_threads(threads, [&] {
            int calls = 0;
            const std::string text = written([&](int file) {
                EXPECT_THROW(write_disagreements(file, distances, list,
                                                 [&](double) {
                                                     if (++calls == 2) {
                                                         throw Enough();
                                                     }
                                                 }),
                             Enough);
            });
            EXPECT_EQ(calls, 2);
            EXPECT_LT(text.size(), whole);
        });
    }
}

TEST(Tables, AFullDiskIsReported) {
    const Distances distances = random_cases()[0].make(20, 11);
    const std::vector<Configuration> list = all_disagreements(distances);
    const int full = ::open("/dev/full", O_WRONLY | O_CLOEXEC);
    ASSERT_GE(full, 0);
    const auto expect_full = [](const std::function<void()>& write) {
        try {
            write();
            ADD_FAILURE() << "nothing thrown";
        } catch (const std::system_error& error) {
            EXPECT_EQ(error.code().value(), ENOSPC);
        }
    };
    expect_full([&] { write_pairs(full, distances); });
    expect_full([&] { write_disagreements(full, distances, list); });
    expect_full([&] { write_selection(full, distances, list); });
    ::close(full);
}

TEST(Tables, AnErrorOnTheWayIsReported) {
    // A pipe that nobody reads takes the header and some rows, then refuses.
    const Distances distances = random_cases()[0].make(24, 12);
    const std::vector<Configuration> list = all_disagreements(distances);
    std::array<int, 2> ends{};
    ASSERT_EQ(::pipe2(ends.data(), O_NONBLOCK | O_CLOEXEC), 0);
    EXPECT_THROW(write_disagreements(ends[1], distances, list), std::system_error);
    ::close(ends[0]);
    ::close(ends[1]);
}

}  // namespace
}  // namespace merl::scan
